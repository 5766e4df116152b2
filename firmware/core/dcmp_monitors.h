/* Monitors: what may not happen while the amplifier is live, written so that NaN fails closed. State goes in and out by value.
 * dcmp_hil/safety/{monitors,outlier_filter}.py have the same operations in the same order, and say why they are these.
 * A fault that a device reports is not among them: it has no place in the law, and goes before them. */
#ifndef DCMP_MONITORS_H
#define DCMP_MONITORS_H

#include "dcmp_cause.h"
#include "dcmp_control.h"
#include "dcmp_time.h"

/* --------------------------------------------------------------------------------------------------- wrong positions */

#define DCMP_OUTLIERS_WINDOW 100 /* samples, in which a third one ends the run */

struct dcmp_outlier_setup {
    real speed; /* rad/s: what is more than both since the last sample that was kept, is off */
    real floor; /* rad */
    real usual; /* rad, from one sample to the next: what needs no further look */
};

/* All 0: no sample yet. */
struct dcmp_outliers {
    int64_t tick; /* of the last sample that was kept */
    real position;
    int64_t samples;
    int64_t oldest; /* sample, of the last three that were off; 0 for none */
    int64_t middle;
    int64_t newest;
    int64_t count; /* samples left out so far */
    struct dcmp_objection objection;
    bool began;
    bool off; /* whether this sample is to be left out, as if it had been lost */
};

/* Judge a sample: one that is off may be left out, the third within the window ends the run. */
static inline struct dcmp_outliers dcmp_outliers_take(struct dcmp_outliers now, struct dcmp_outlier_setup setup,
                                                      int64_t tick, real position, real period)
{
    struct dcmp_outliers next = now;
    const real way = position - now.position;
    const real moved = dcmp_magnitude(way);
    next.samples = now.samples + 1;
    next.off = false;
    bool usual = !now.began || moved <= setup.usual;
    if (!usual) {
        const real reached = setup.speed * dcmp_elapsed(now.tick, tick, period);
        const real allowed = setup.floor > reached ? setup.floor : reached;
        usual = !(allowed < moved && dcmp_is_finite(moved)); /* what is no number is for others to judge */
    }
    if (usual) {
        next.began = true;
        next.tick = tick;
        next.position = position;
        return next;
    }
    next.oldest = now.middle;
    next.middle = now.newest;
    next.newest = next.samples;
    next.off = next.oldest == 0 || next.samples - next.oldest >= DCMP_OUTLIERS_WINDOW;
    if (next.off) {
        next.count = now.count + 1;
    } else {
        const struct dcmp_objection objection = {tick, DCMP_CAUSE_JUMP, way, REAL(0.0)};
        next.objection = objection;
    }
    return next;
}

/* ------------------------------------------------------------------------------------------------ numbers and ranges */

/* Every number of sample and estimate is finite; t in s. */
static inline bool dcmp_all_finite(real t, real position, real voltage, struct dcmp_estimate estimate)
{
    return dcmp_is_finite(t + position + voltage + estimate.position + estimate.velocity + estimate.disturbance);
}

struct dcmp_range {
    real position; /* rad, either way from hanging: the encoder's own */
    real velocity; /* rad/s, either way: what an estimate may show */
};

/* DCMP_CAUSE_SPEED or DCMP_CAUSE_TRAVEL outside the limits. */
static inline enum dcmp_cause dcmp_range_cause(struct dcmp_range range, real position, real velocity)
{
    if (!(dcmp_magnitude(velocity) <= range.velocity)) {
        return DCMP_CAUSE_SPEED;
    }
    return dcmp_magnitude(position) <= range.position ? DCMP_CAUSE_NONE : DCMP_CAUSE_TRAVEL;
}

/* ---------------------------------------------------------------------------------------------- the watching observer */

struct dcmp_watch_setup {
    real velocity; /* rad/s, either way: what its estimate may show */
    real keep;     /* of the filtered disturbance after a period */
    real limit;    /* rad/s2 */
    int32_t cycles; /* that the disturbance may not stay above it */
};

/* All 0: nothing seen yet. */
struct dcmp_watch {
    real filtered; /* rad/s2 */
    int32_t above; /* cycles */
    enum dcmp_cause cause;
};

/* Judge what the second observer sees: DCMP_CAUSE_WATCH_SPEED, or DCMP_CAUSE_DISTURBANCE, of the filtered disturbance. */
static inline struct dcmp_watch dcmp_watch_judge(struct dcmp_watch now, struct dcmp_watch_setup setup,
                                                 struct dcmp_estimate seen)
{
    struct dcmp_watch next = now;
    next.cause = DCMP_CAUSE_NONE;
    if (!(dcmp_magnitude(seen.velocity) <= setup.velocity)) {
        next.cause = DCMP_CAUSE_WATCH_SPEED;
        return next;
    }
    next.filtered = seen.disturbance + setup.keep * (now.filtered - seen.disturbance);
    if (dcmp_magnitude(next.filtered) <= setup.limit) {
        next.above = 0;
        return next;
    }
    next.above = now.above + 1;
    if (next.above >= setup.cycles || next.filtered != next.filtered) {
        next.cause = DCMP_CAUSE_DISTURBANCE;
    }
    return next;
}

#endif
