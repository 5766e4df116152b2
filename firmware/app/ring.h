/* Bytes from one context to another, an interrupt and its elder: one writes, one reads, neither waits. */
#ifndef RING_H
#define RING_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define RING_BYTES 1024u /* a power of two, so that the counters may wrap */

struct ring {
    _Atomic uint32_t written; /* ever */
    _Atomic uint32_t read;    /* ever */
    uint8_t bytes[RING_BYTES];
};

/* Put all of it in, or nothing: false then. For the writer. */
bool ring_put(struct ring *ring, const uint8_t *bytes, size_t length);

/* Whether there is nothing in it, for either. */
bool ring_is_empty(const struct ring *ring);

/* How much could be put in; for the writer. */
size_t ring_room(const struct ring *ring);

/* Take out what there is, `room` at most. For the reader. */
size_t ring_take(struct ring *ring, uint8_t *bytes, size_t room);

#endif
