/* Modular counts in; travel, speed and jumps out.
 * Of travel and speed the middle one of the newest three periods counts, so that one wrong count never shows. */
#ifndef DCMP_ENCODER_H
#define DCMP_ENCODER_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_history.h"

#define DCMP_COUNT_MASK 0xFFFFFFu /* the wire has 24 bits, so no more are looked at */
#define DCMP_SPEED_PERIODS_MAX 160u /* 8 ms of the shortest period */
#define DCMP_POSITIONS (DCMP_SPEED_PERIODS_MAX + 3u) /* the longest window, ending in each of three periods */
#define DCMP_WINDOWS 3u /* that speed is taken over */
#define DCMP_JUMP_LIMIT 3u /* within 100 periods */

/* A time that speed is taken over. */
struct dcmp_window {
    uint8_t periods;
    uint8_t spare; /* counts that it may show more than the limit says */
    int32_t us;
};

/* counts/s: over the short windows what the board was built with holds, over the longest what a session set. */
struct dcmp_speed_limits {
    int32_t built;
    int32_t session;
};

struct dcmp_encoder {
    uint32_t raw;                 /* the newest count modulo 2^24 */
    uint32_t raw_before;          /* the one before */
    uint32_t raw_oldest;          /* and the one before that */
    bool started;
    int64_t position;             /* unwrapped, without jumps */
    int64_t past[DCMP_POSITIONS]; /* the newest positions, a ring */
    uint8_t newest;               /* where in the ring */
    struct dcmp_window windows[DCMP_WINDOWS]; /* the shortest first */
    int32_t jump;                 /* the last one, counts */
    bool jumped;                  /* in the newest period */
    struct dcmp_history jumps;
    bool anchored;
    int64_t origin;               /* where it was when it was armed for the first time */
};

void dcmp_encoder_init(struct dcmp_encoder *encoder, int32_t period_us);

/* The count of a new period; a jump is what the board was not built for. */
void dcmp_encoder_tick(struct dcmp_encoder *encoder, uint32_t counts, int32_t built_speed_limit, int32_t period_us);

/* Travel counts from here; only the first call does anything. */
void dcmp_encoder_anchor(struct dcmp_encoder *encoder);

bool dcmp_encoder_too_jumpy(const struct dcmp_encoder *encoder);
bool dcmp_encoder_too_fast(const struct dcmp_encoder *encoder, const struct dcmp_speed_limits *limits);
bool dcmp_encoder_too_far(const struct dcmp_encoder *encoder, int32_t travel_limit);

/* For reports: counts/s, counts; the nearest 32-bit number. The speed is the one that is too high, if one is. */
int32_t dcmp_encoder_speed(const struct dcmp_encoder *encoder, const struct dcmp_speed_limits *limits);
int32_t dcmp_encoder_travel(const struct dcmp_encoder *encoder);

/* From a count that was given to where the encoder is, the shortest way. */
int32_t dcmp_encoder_distance(const struct dcmp_encoder *encoder, int32_t origin_counts);

#endif
