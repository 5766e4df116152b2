/* Time in the law: whole ticks of the loop, as seconds in single precision lose microseconds within minutes.
 * In double, every difference has the bits that a host gets from t = tick * period. */
#ifndef DCMP_TIME_H
#define DCMP_TIME_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_real.h"

/* The instant of a tick, s. */
static inline real dcmp_instant(int64_t tick, real period)
{
    return (real)tick * period;
}

/* The time from one tick to another, s. */
static inline real dcmp_elapsed(int64_t from, int64_t to, real period)
{
#ifdef DCMP_REAL_FLOAT
    return (real)(int32_t)(to - from) * period;
#else
    return (real)to * period - (real)from * period;
#endif
}

/* How long a condition has held, told only of the ticks at which it does. All 0: never yet. */
struct dcmp_lasting {
    int64_t since; /* tick */
    int64_t last;
    bool began;
};

/* Note that the condition holds at a tick; after more than `gap`, s, it begins anew. */
static inline struct dcmp_lasting dcmp_holds(struct dcmp_lasting lasting, int64_t tick, real gap, real period)
{
    const bool goes_on = lasting.began && dcmp_elapsed(lasting.last, tick, period) <= gap;
    const struct dcmp_lasting next = {goes_on ? lasting.since : tick, tick, true};
    return next;
}

/* Whether a condition that holds has held for `allowed`, s, or longer. */
static inline bool dcmp_lasts(struct dcmp_lasting lasting, real allowed, real period)
{
    return dcmp_elapsed(lasting.since, lasting.last, period) >= allowed;
}

/* When something was told of last. All 0: never yet. */
struct dcmp_told {
    int64_t last; /* tick */
    bool ever;
};

/* Whether it is told at a tick: at most once in `pause`, s. The caller notes that it is. */
static inline bool dcmp_may_tell(struct dcmp_told told, int64_t tick, real pause, real period)
{
    return !(told.ever && dcmp_elapsed(told.last, tick, period) < pause);
}

#endif
