/* Random numbers by number, not by order: Philox4x32-10 of Salmon, Moraes, Dror and Shaw (SC11, 2011).
 * dcmp_hil/control/counted_random.py has the same operations in the same order. No branches. */
#ifndef DCMP_RANDOM_H
#define DCMP_RANDOM_H

#include "dcmp_elementary.h"

#define DCMP_STREAM_ENCODER_NOISE 0u
#define DCMP_STREAM_LOST_SAMPLES 1u

#define DCMP_PHILOX_ROUNDS 10

struct dcmp_random_words {
    uint32_t a;
    uint32_t b;
    uint32_t c;
    uint32_t d;
};

struct dcmp_random_key {
    uint32_t low; /* of the seed */
    uint32_t high;
};

static inline struct dcmp_random_words dcmp_philox(struct dcmp_random_words block, struct dcmp_random_key key)
{
    uint32_t low = key.low;
    uint32_t high = key.high;
    for (int round = 0; round < DCMP_PHILOX_ROUNDS; round++) {
        const uint64_t first = (uint64_t)block.a * 0xD2511F53u;
        const uint64_t second = (uint64_t)block.c * 0xCD9E8D57u;
        const struct dcmp_random_words next = {(uint32_t)(second >> 32) ^ block.b ^ low, (uint32_t)second,
                                               (uint32_t)(first >> 32) ^ block.d ^ high, (uint32_t)first};
        block = next;
        low += 0x9E3779B9u;
        high += 0xBB67AE85u;
    }
    return block;
}

static inline struct dcmp_random_words dcmp_random_words_of(struct dcmp_random_key key, uint32_t stream,
                                                            uint64_t counter)
{
    const struct dcmp_random_words block = {(uint32_t)counter, (uint32_t)(counter >> 32), stream, 0u};
    return dcmp_philox(block, key);
}

/* From 0 to below 1: 53 bits as double, 24 as float. */
static inline real dcmp_random_fraction(uint32_t high, uint32_t low)
{
#ifdef DCMP_REAL_FLOAT
    (void)low;
    return REAL((int32_t)(high >> 8)) * DCMP_RANDOM_UNIT;
#else
    return (REAL((int32_t)(high >> 5)) * REAL(67108864.0) + REAL((int32_t)(low >> 6))) * DCMP_RANDOM_UNIT;
#endif
}

/* From 0 to below 1. */
static inline real dcmp_random_uniform(struct dcmp_random_key key, uint32_t stream, uint64_t counter)
{
    const struct dcmp_random_words words = dcmp_random_words_of(key, stream, counter);
    return dcmp_random_fraction(words.a, words.b);
}

/* Normal distribution, mean 0 and deviation 1, after Box and Muller (1958). */
static inline real dcmp_random_normal(struct dcmp_random_key key, uint32_t stream, uint64_t counter)
{
    const struct dcmp_random_words words = dcmp_random_words_of(key, stream, counter);
    const real radius =
        dcmp_square_root(REAL(-2.0) * dcmp_logarithm(dcmp_random_fraction(words.a, words.b) + DCMP_RANDOM_UNIT));
    return radius * dcmp_sine(REAL(6.283185307179586) * (dcmp_random_fraction(words.c, words.d) - REAL(0.5)));
}

#endif
