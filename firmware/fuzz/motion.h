/* What the page says of counts: travel, speed, jumps. Positions are kept in order, the newest first. */
#ifndef FUZZ_MOTION_H
#define FUZZ_MOTION_H

#include <stdbool.h>
#include <stdint.h>

#define MOTION_PAST 256u /* more than any window, and a power of 2 */
#define MOTION_JUMPS 100u

struct motion {
    bool begun;
    uint32_t counts[3];    /* the newest first, 24 bits */
    int64_t at[MOTION_PAST];
    uint32_t newest;
    bool jumped;
    int32_t jump;          /* the last one */
    uint32_t jumps[3];     /* ticks of the newest three, from 1 on; 0 is none */
    uint32_t tick;
    bool placed;           /* was armed once */
    int64_t origin;
};

/* What a session and a board allow. */
struct motion_limits {
    int64_t period_us;
    int64_t speed; /* counts/s, over 8 ms */
    int64_t built_speed; /* over 1 and 2 ms */
    int64_t travel;
    int64_t built_travel;
    int32_t origin; /* that a session gave, -1 for none */
};

/* What the counts say is wrong: code and detail of a fault, 0 for nothing. */
struct motion_fault {
    uint32_t code;
    int32_t detail;
};

void motion_tick(struct motion *motion, uint32_t counts, int64_t built_speed, int64_t period_us);
void motion_arm(struct motion *motion);
struct motion_fault motion_judge(const struct motion *motion, const struct motion_limits *limits);

#endif
