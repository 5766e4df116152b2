/* The wire as docs/protocol.md describes it, written a second time: checksums, COBS, slcan. Nothing here is the core's
 * but the structure of a frame, so that an error of the core's codec is not made twice. */
#ifndef FUZZ_WIRE_H
#define FUZZ_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dcmp_frame.h"

#define WIRE_REPLY_MAX 8u
#define WIRE_BYTES_MAX 24u /* of a frame in either form */

enum wire_number {
    WIRE_STOP = 1, WIRE_DRIVE, WIRE_FAULT, WIRE_SAMPLE, WIRE_EDGE, WIRE_HELLO, WIRE_IDENTITY, WIRE_GET, WIRE_SET,
    WIRE_VALUE, WIRE_HEALTH
};

enum wire_heard { WIRE_NOTHING, WIRE_FRAME, WIRE_CORRUPT, WIRE_REPLY };

/* What a line has said since its last end. */
struct wire_ear {
    bool slcan;
    bool closed;        /* by the command C */
    uint8_t bytes[32];  /* one more than the longest that is taken */
    uint32_t length;    /* stops at one more than the longest */
    uint8_t reply[WIRE_REPLY_MAX];
    uint32_t replied;
};

/* Once, before anything else: the tables. */
void wire_prepare(void);

/* The bytes of a message from the host that this number has; 0 for one that a host does not send. */
uint8_t wire_length_from_host(uint32_t number);

uint8_t wire_crc8(const struct dcmp_frame *frame);

/* An empty payload of a message, fields put into it from bit 0 on, and its end. */
struct dcmp_frame wire_begin(enum wire_number number, uint32_t node);
void wire_put(struct dcmp_frame *frame, uint32_t value, uint32_t bytes);
void wire_seal(struct dcmp_frame *frame);
uint32_t wire_get(const struct dcmp_frame *frame, uint32_t at, uint32_t bytes);

size_t wire_cobs(const struct dcmp_frame *frame, uint8_t bytes[WIRE_BYTES_MAX]);
size_t wire_slcan(const struct dcmp_frame *frame, uint8_t bytes[WIRE_BYTES_MAX]);
enum wire_heard wire_hear(struct wire_ear *ear, uint8_t byte, struct dcmp_frame *frame);

#endif
