/* Frames on a byte stream: slcan lines, upper-case hex, ended by CR. */
#ifndef DCMP_SLCAN_H
#define DCMP_SLCAN_H

#include <stdbool.h>
#include <stddef.h>

#include "dcmp_frame.h"

#define DCMP_SLCAN_LINE_MAX 31u    /* without CR */
#define DCMP_SLCAN_ENCODED_MAX 22u /* t, id, length, 16 digits, CR */
#define DCMP_SLCAN_REPLY_MAX 6u

struct dcmp_slcan {
    uint8_t line[DCMP_SLCAN_LINE_MAX];
    uint8_t length;
    bool overlong;                       /* everything up to the next CR is lost */
    bool open;                           /* frames may be sent */
    uint8_t reply[DCMP_SLCAN_REPLY_MAX]; /* to be sent on DCMP_REPLY, and on DCMP_CORRUPT if not empty */
    uint8_t reply_length;
};

void dcmp_slcan_init(struct dcmp_slcan *slcan);

/* Take one byte; `frame` is written on DCMP_FRAME only. */
enum dcmp_received dcmp_slcan_receive(struct dcmp_slcan *slcan, uint8_t byte, struct dcmp_frame *frame);

/* Write a frame with its CR; returns how many bytes it took. */
size_t dcmp_slcan_send(const struct dcmp_frame *frame, uint8_t bytes[DCMP_SLCAN_ENCODED_MAX]);

#endif
