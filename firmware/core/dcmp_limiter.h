/* The limiter of reference, voltage and slew: the one that acts is told of, and none may act for long. And chatter: a voltage that
 * changes far more than gains, encoder and reference explain.
 * dcmp_hil/safety/{limiter,chatter}.py have the same operations in the same order, and say why they are these.
 * What is bounded by the governor comes from dcmp_governor.h. */
#ifndef DCMP_LIMITER_H
#define DCMP_LIMITER_H

#include "dcmp_cause.h"
#include "dcmp_control.h"
#include "dcmp_time.h"

#define DCMP_TELL_PAUSE REAL(1.0)          /* s, from one time that a limit is told of to the next */
#define DCMP_SATURATION_TIME_MAX REAL(0.5) /* s in a row at a limit of the voltage that end the run */
#define DCMP_TRACKING_TIME_MAX REAL(0.5)   /* s in a row that the arm may be too far from the reference */

/* ---------------------------------------------------------------------------------------------------------- chatter */

#define DCMP_CHATTER_BLOCKS 10 /* half a second */
#define DCMP_CHATTER_RATES (DCMP_CHATTER_BLOCKS + 1)
#define DCMP_BURST_WEIGHT 2
#define DCMP_PAUSE_WEIGHT 1
#define DCMP_BURST_SCORE_MAX 40

/* All 0: no block yet. */
struct dcmp_chatter {
    int64_t tick;                   /* of the end of the last block */
    real rates[DCMP_CHATTER_RATES]; /* V/s, of the newest blocks, the newest last */
    int32_t known;                  /* of them */
    int32_t bursts;
    real mean; /* V/s */
    bool began;
    bool found; /* whether this is chatter */
};

/* Take the mean |dV/dt| of a block, V/s. */
static inline struct dcmp_chatter dcmp_chatter_take(struct dcmp_chatter now, real rate)
{
    struct dcmp_chatter next = now;
    for (int32_t i = 0; i < DCMP_CHATTER_RATES - 1; i++) {
        next.rates[i] = now.rates[i + 1];
    }
    next.rates[DCMP_CHATTER_RATES - 1] = rate;
    next.known = now.known < DCMP_CHATTER_RATES ? now.known + 1 : DCMP_CHATTER_RATES;
    real sum = REAL(0.0);
    for (int32_t i = 1; i < DCMP_CHATTER_RATES; i++) { /* in this order; those that are not known yet are 0 */
        sum = sum + next.rates[i];
    }
    next.mean = sum / REAL(DCMP_CHATTER_BLOCKS);
    return next;
}

/* Whether all blocks that are kept are known, and no two in a row are a pause. */
static inline bool dcmp_chatter_is_steady(struct dcmp_chatter now, real limit)
{
    bool steady = now.known == DCMP_CHATTER_RATES;
    for (int32_t i = 1; i < DCMP_CHATTER_RATES; i++) {
        steady = steady && now.rates[i - 1] + now.rates[i] >= limit;
    }
    return steady;
}

/* Judge a block that ends at a tick, in which the voltage changed by `change`, V in all; the limit in V/s. */
static inline struct dcmp_chatter dcmp_chatter_judge(struct dcmp_chatter now, real limit, int64_t tick, real change,
                                                     real period)
{
    const real gone = dcmp_elapsed(now.tick, tick, period);
    const bool first = !now.began || !(gone > REAL(0.0));
    struct dcmp_chatter next = first ? now : dcmp_chatter_take(now, change / gone);
    next.tick = tick;
    next.began = true;
    next.found = false;
    if (first) {
        return next;
    }
    const real newest = next.rates[DCMP_CHATTER_RATES - 2] + next.rates[DCMP_CHATTER_RATES - 1];
    const bool goes_on = next.mean >= limit && newest >= limit;
    const int32_t fewer = now.bursts > DCMP_PAUSE_WEIGHT ? now.bursts - DCMP_PAUSE_WEIGHT : 0;
    next.bursts = goes_on ? now.bursts + DCMP_BURST_WEIGHT : fewer;
    const bool steady = goes_on && dcmp_chatter_is_steady(next, limit);
    next.found = steady || next.bursts >= DCMP_BURST_SCORE_MAX;
    return next;
}

/* ---------------------------------------------------------------------------------------------------------- limits */

/* The nearest value that is at most `most` either way. */
static inline real dcmp_limited(real most, real value)
{
    const real below = value < most ? value : most;
    return below > -most ? below : -most;
}

/* The voltage, or the nearest that a step of at most `step` allows after `last`; all in V. */
static inline real dcmp_slewed(real step, real voltage, real last)
{
    const real up = last + step;
    const real down = last - step;
    const real below = voltage < up ? voltage : up;
    return below > down ? below : down;
}

enum dcmp_limit {
    DCMP_LIMIT_NONE = 0,
    DCMP_LIMIT_REFERENCE = 1,    /* first, second: the limit, and what was asked for, rad */
    DCMP_LIMIT_VELOCITY = 2,     /* as above, rad/s */
    DCMP_LIMIT_ACCELERATION = 3, /* as above, rad/s2 */
    DCMP_LIMIT_WAY = 4,          /* first: where the reference is, rad */
    DCMP_LIMIT_VOLTAGE = 5,      /* first, second: asked for, and the limit, V */
    DCMP_LIMIT_SLEW = 6          /* first, second: asked for, and what was sent before, V */
};

#define DCMP_LIMIT_KINDS 7

/* A limit that acts, and is to be told of now. */
struct dcmp_limit_told {
    enum dcmp_limit limit;
    real first;
    real second;
};

struct dcmp_limiter_setup {
    real period;        /* s, nominal */
    real gap;           /* s, between two cycles of one condition, at most */
    real voltage;       /* V, either way; infinity for none, as for all of these */
    real step;          /* V, of the slew in a period */
    real position;      /* rad, of the reference */
    real velocity;      /* rad/s */
    real acceleration;  /* rad/s2 */
    real error;         /* rad, by which the measured position may be off the reference for half a second */
    real chatter;       /* V/s, from which on the variation is chatter */
    int32_t block;      /* cycles of a block of the variation; 0 to judge none */
    bool slews;         /* whether the slew has a limit */
};

struct dcmp_limiter {
    struct dcmp_lasting saturated;
    struct dcmp_lasting astray;
    struct dcmp_told told[DCMP_LIMIT_KINDS];
    struct dcmp_limit_told of_reference; /* what is told in this cycle; DCMP_LIMIT_NONE for nothing */
    struct dcmp_limit_told of_voltage;
    struct dcmp_limit_told of_slew;
    struct dcmp_objection objection; /* why the run should end */
    struct dcmp_chatter variation;
    real change;     /* V, sum of |dV| in this block */
    int32_t left;    /* cycles to its end */
    int64_t clamped; /* cycles in which the demand was more than the limits allowed */
};

static inline struct dcmp_limiter dcmp_limiter_begin(const struct dcmp_limiter_setup *setup)
{
    const struct dcmp_limiter first = {.left = setup->block};
    return first;
}

/* What is told of a limit that acts at a tick: nothing, if it was told of a moment ago. */
static inline struct dcmp_limit_told dcmp_limiter_tell(struct dcmp_limiter *limiter,
                                                       const struct dcmp_limiter_setup *setup, int64_t tick,
                                                       struct dcmp_limit_told acts)
{
    const struct dcmp_limit_told nothing = {DCMP_LIMIT_NONE, REAL(0.0), REAL(0.0)};
    struct dcmp_told *told = &limiter->told[acts.limit];
    if (!dcmp_may_tell(*told, tick, DCMP_TELL_PAUSE, setup->period)) {
        return nothing;
    }
    told->last = tick;
    told->ever = true;
    return acts;
}

/* Which limit a reference meets that the governor does not let pass. */
static inline struct dcmp_limit_told dcmp_limit_of(const struct dcmp_limiter_setup *setup,
                                                   struct dcmp_reference asked)
{
    struct dcmp_limit_told acts = {DCMP_LIMIT_WAY, asked.position, REAL(0.0)};
    if (!(dcmp_magnitude(asked.position) <= setup->position)) {
        const struct dcmp_limit_told position = {DCMP_LIMIT_REFERENCE, setup->position, asked.position};
        acts = position;
    } else if (!(dcmp_magnitude(asked.velocity) <= setup->velocity)) {
        const struct dcmp_limit_told velocity = {DCMP_LIMIT_VELOCITY, setup->velocity, asked.velocity};
        acts = velocity;
    } else if (!(dcmp_magnitude(asked.acceleration) <= setup->acceleration)) {
        const struct dcmp_limit_told acceleration = {DCMP_LIMIT_ACCELERATION, setup->acceleration,
                                                     asked.acceleration};
        acts = acceleration;
    } else {
        /* It is the way that is limited. */
    }
    return acts;
}

/* Judge the reference of a cycle, before its voltage: `asked` for, and as `governed`, with whether the governor `leads`, so that
 * it is not what was asked for; the measured position in rad. */
static inline void dcmp_limit_reference(struct dcmp_limiter *limiter, const struct dcmp_limiter_setup *setup,
                                        int64_t tick, real position, struct dcmp_reference asked,
                                        struct dcmp_reference governed, bool leads)
{
    const struct dcmp_limit_told nothing = {DCMP_LIMIT_NONE, REAL(0.0), REAL(0.0)};
    limiter->of_reference = nothing;
    limiter->of_voltage = nothing;
    limiter->of_slew = nothing;
    if (!(dcmp_magnitude(governed.position - position) <= setup->error)) {
        limiter->astray = dcmp_holds(limiter->astray, tick, setup->gap, setup->period);
        if (dcmp_lasts(limiter->astray, DCMP_TRACKING_TIME_MAX, setup->period)) {
            const struct dcmp_objection objection = {tick, DCMP_CAUSE_TRACKING, governed.position, position};
            limiter->objection = objection;
        }
    }
    if (leads) {
        limiter->of_reference = dcmp_limiter_tell(limiter, setup, tick, dcmp_limit_of(setup, asked));
    }
}

/* Note that the demand, V, was more than the limits allowed. */
static inline void dcmp_limiter_clamped(struct dcmp_limiter *limiter, const struct dcmp_limiter_setup *setup,
                                        int64_t tick, real demand)
{
    limiter->clamped += 1;
    limiter->saturated = dcmp_holds(limiter->saturated, tick, setup->gap, setup->period);
    if (dcmp_lasts(limiter->saturated, DCMP_SATURATION_TIME_MAX, setup->period)) {
        const struct dcmp_objection objection = {tick, DCMP_CAUSE_SATURATION, demand, REAL(0.0)};
        limiter->objection = objection;
    }
}

/* The demand, V, or what limits of voltage and slew allow of it after `last`, V. */
static inline real dcmp_limiter_bound(struct dcmp_limiter *limiter, const struct dcmp_limiter_setup *setup,
                                      int64_t tick, real demand, real last)
{
    const real voltage = dcmp_limited(setup->voltage, demand);
    const real slewed = setup->slews ? dcmp_slewed(setup->step, voltage, last) : voltage;
    if (voltage != demand) {
        const struct dcmp_limit_told acts = {DCMP_LIMIT_VOLTAGE, demand, setup->voltage};
        limiter->of_voltage = dcmp_limiter_tell(limiter, setup, tick, acts);
    }
    if (slewed != voltage) {
        const struct dcmp_limit_told acts = {DCMP_LIMIT_SLEW, voltage, last};
        limiter->of_slew = dcmp_limiter_tell(limiter, setup, tick, acts);
    }
    if (slewed != demand) {
        dcmp_limiter_clamped(limiter, setup, tick, demand);
    }
    return slewed;
}

/* Judge the variation at the end of a block. */
static inline void dcmp_limiter_block(struct dcmp_limiter *limiter, const struct dcmp_limiter_setup *setup,
                                      int64_t tick)
{
    if (limiter->objection.cause == DCMP_CAUSE_NONE) {
        limiter->variation =
            dcmp_chatter_judge(limiter->variation, setup->chatter, tick, limiter->change, setup->period);
        if (limiter->variation.found) {
            const struct dcmp_objection objection = {tick, DCMP_CAUSE_CHATTER, limiter->variation.mean, REAL(0.0)};
            limiter->objection = objection;
        }
    }
    limiter->change = REAL(0.0);
    limiter->left = setup->block;
}

/* The demand, V, or what of it is allowed after `last`, V, with full authority. */
static inline real dcmp_limit_voltage(struct dcmp_limiter *limiter, const struct dcmp_limiter_setup *setup,
                                      int64_t tick, real demand, real last)
{
    real voltage = demand;
    if (setup->slews || !(dcmp_magnitude(demand) <= setup->voltage)) {
        voltage = dcmp_limiter_bound(limiter, setup, tick, demand, last);
    }
    if (setup->block > 0) {
        limiter->change = limiter->change + (voltage > last ? voltage - last : last - voltage);
        limiter->left -= 1;
        if (limiter->left == 0) {
            dcmp_limiter_block(limiter, setup, tick);
        }
    }
    return voltage;
}

#endif
