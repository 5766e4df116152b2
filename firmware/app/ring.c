#include "ring.h"

static uint32_t filled(const struct ring *ring)
{
    return atomic_load_explicit(&ring->written, memory_order_acquire) -
           atomic_load_explicit(&ring->read, memory_order_acquire);
}

bool ring_is_empty(const struct ring *ring)
{
    return filled(ring) == 0u;
}

size_t ring_room(const struct ring *ring)
{
    return RING_BYTES - filled(ring);
}

bool ring_put(struct ring *ring, const uint8_t *bytes, size_t length)
{
    const uint32_t written = atomic_load_explicit(&ring->written, memory_order_relaxed);
    if (length > ring_room(ring)) {
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        ring->bytes[(written + i) % RING_BYTES] = bytes[i];
    }
    atomic_store_explicit(&ring->written, written + (uint32_t)length, memory_order_release);
    return true;
}

size_t ring_take(struct ring *ring, uint8_t *bytes, size_t room)
{
    const uint32_t read = atomic_load_explicit(&ring->read, memory_order_relaxed);
    const size_t there = filled(ring);
    const size_t length = there < room ? there : room;
    for (size_t i = 0; i < length; i++) {
        bytes[i] = ring->bytes[(read + i) % RING_BYTES];
    }
    atomic_store_explicit(&ring->read, read + (uint32_t)length, memory_order_release);
    return length;
}
