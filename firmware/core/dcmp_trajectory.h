/* The trajectory of a run: it stays where the arm is, begins, and fades into the reference. dcmp_hil/control/trajectory.py has
 * the same operations in the same order. The reference itself is the caller's. */
#ifndef DCMP_TRAJECTORY_H
#define DCMP_TRAJECTORY_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_control.h"
#include "dcmp_time.h"

/* All 0: not begun, at 0 rad. */
struct dcmp_trajectory {
    int64_t start; /* tick at which it began */
    real x0;       /* rad, where it stays, or began */
    bool begun;
};

/* The weight of the reference in a soft start, with its derivatives. */
struct dcmp_fade {
    real gone;
    real gone1; /* 1/s */
    real gone2; /* 1/s2 */
};

/* Stay at a position, rad, until it begins. */
static inline struct dcmp_trajectory dcmp_trajectory_hold(struct dcmp_trajectory now, real position)
{
    const struct dcmp_trajectory next = {now.start, position, now.begun};
    return next;
}

/* Begin at a tick, from a position, rad. */
static inline struct dcmp_trajectory dcmp_trajectory_begin(int64_t tick, real position)
{
    const struct dcmp_trajectory next = {tick, position, true};
    return next;
}

/* An instant of the trajectory: its reference is asked for `since` seconds after it began. */
struct dcmp_moment {
    real since;
    bool fades; /* the soft start acts */
};

#ifdef DCMP_REAL_FLOAT

/* The instant `later` seconds after a tick; soft_start in s, 0 for none. */
static inline struct dcmp_moment dcmp_moment_after(struct dcmp_trajectory now, int64_t tick, real later, real soft_start,
                                                   real period)
{
    const real since = dcmp_elapsed(now.start, tick, period) + later;
    const struct dcmp_moment moment = {since, since < soft_start};
    return moment;
}

/* The middle between two ticks. */
static inline struct dcmp_moment dcmp_moment_between(struct dcmp_trajectory now, int64_t before, int64_t tick,
                                                     real soft_start, real period)
{
    const real later = REAL(0.5) * dcmp_elapsed(before, tick, period);
    return dcmp_moment_after(now, before, later, soft_start, period);
}

#else

/* The instant t, s. The host compares it with the end of the soft start first, which is rounded. */
static inline struct dcmp_moment dcmp_moment_at(struct dcmp_trajectory now, real t, real soft_start, real period)
{
    const real start = dcmp_instant(now.start, period);
    const real since = t - start;
    const struct dcmp_moment moment = {since, t < start + soft_start && since < soft_start};
    return moment;
}

/* The instant `later` seconds after a tick; soft_start in s, 0 for none. */
static inline struct dcmp_moment dcmp_moment_after(struct dcmp_trajectory now, int64_t tick, real later, real soft_start,
                                                   real period)
{
    return dcmp_moment_at(now, dcmp_instant(tick, period) + later, soft_start, period);
}

/* The middle between two ticks. */
static inline struct dcmp_moment dcmp_moment_between(struct dcmp_trajectory now, int64_t before, int64_t tick,
                                                     real soft_start, real period)
{
    const real t = REAL(0.5) * (dcmp_instant(tick, period) + dcmp_instant(before, period));
    return dcmp_moment_at(now, t, soft_start, period);
}

#endif

/* `since` it began, from 0 to below `length`, that of the soft start, in s. */
static inline struct dcmp_fade dcmp_fade(real since, real length)
{
    const real s = since / length;
    const real left = REAL(1.0) - s;
    const struct dcmp_fade fade = {
        s * s * s * (REAL(10.0) + s * (REAL(6.0) * s - REAL(15.0))),
        REAL(30.0) * s * s * (left * left) / length,
        REAL(60.0) * s * left * (REAL(1.0) - REAL(2.0) * s) / (length * length),
    };
    return fade;
}

/* (1 - b) x0 + b x_r, and its derivatives. */
static inline struct dcmp_reference dcmp_faded_in(struct dcmp_reference reference, real x0, struct dcmp_fade fade)
{
    const real way = reference.position - x0;
    const struct dcmp_reference faded = {
        x0 + fade.gone * way,
        fade.gone * reference.velocity + fade.gone1 * way,
        fade.gone * reference.acceleration + REAL(2.0) * fade.gone1 * reference.velocity + fade.gone2 * way,
    };
    return faded;
}

/* What the trajectory makes of the value of its reference at an instant. */
static inline struct dcmp_reference dcmp_trajectory_at(struct dcmp_trajectory now, struct dcmp_moment moment,
                                                       real soft_start, struct dcmp_reference reference)
{
    const struct dcmp_reference rest = {now.x0, REAL(0.0), REAL(0.0)};
    if (!now.begun || moment.since < REAL(0.0)) {
        return rest;
    }
    return moment.fades ? dcmp_faded_in(reference, now.x0, dcmp_fade(moment.since, soft_start)) : reference;
}

#endif
