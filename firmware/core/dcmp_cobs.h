/* Frames on a byte stream: COBS(id, payload, CRC-16) 0x00. */
#ifndef DCMP_COBS_H
#define DCMP_COBS_H

#include <stdbool.h>
#include <stddef.h>

#include "dcmp_frame.h"

#define DCMP_COBS_ENCODED_MAX 14u /* 12 bytes, one byte of overhead, the delimiter */

struct dcmp_cobs {
    uint8_t bytes[DCMP_COBS_ENCODED_MAX - 1u];
    uint8_t length;
    bool overlong; /* everything up to the next delimiter is lost */
};

void dcmp_cobs_init(struct dcmp_cobs *cobs);

/* Take one byte; `frame` is written on DCMP_FRAME only. */
enum dcmp_received dcmp_cobs_receive(struct dcmp_cobs *cobs, uint8_t byte, struct dcmp_frame *frame);

/* Write a frame with its delimiter; returns how many bytes it took. */
size_t dcmp_cobs_send(const struct dcmp_frame *frame, uint8_t bytes[DCMP_COBS_ENCODED_MAX]);

#endif
