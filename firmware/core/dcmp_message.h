/* Which frames are messages, and what makes a frame one: its identifier, its length and its crc8. */
#ifndef DCMP_MESSAGE_H
#define DCMP_MESSAGE_H

#include <stdint.h>

#include "dcmp_protocol.h"

enum dcmp_checked {
    DCMP_FOREIGN, /* another node, an unknown number or another length: to be ignored */
    DCMP_DAMAGED, /* wrong crc8 */
    DCMP_GENUINE
};

/* Whether a frame is one of the host's for this node. */
enum dcmp_checked dcmp_check(const struct dcmp_frame *frame, uint8_t node);

/* The same of any message, of either side. */
enum dcmp_checked dcmp_check_any(const struct dcmp_frame *frame, uint8_t node);

/* Set identifier, length and crc8 around a payload that is already there; the rest of the payload is zeroed. */
void dcmp_seal(struct dcmp_frame *frame, enum dcmp_message message, uint8_t node);

#endif
