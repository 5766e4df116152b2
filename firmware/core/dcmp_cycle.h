/* A cycle of the loop as one straight line: dcmp_hil/loop.py with the default observer R1 or the friction filter, their
 * predictors, the PD controller, and all of the supervisor. The reference is the caller's. In the order of a cycle:
 * dcmp_cycle_leaves_out, dcmp_cycle_sense, and dcmp_cycle_act, whose result is to be sent. */
#ifndef DCMP_CYCLE_H
#define DCMP_CYCLE_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_control.h"
#include "dcmp_friction_kalman.h"
#include "dcmp_governor.h"
#include "dcmp_limiter.h"
#include "dcmp_monitors.h"
#include "dcmp_polarity_check.h"
#include "dcmp_run_phases.h"
#include "dcmp_trajectory.h"

/* ------------------------------------------------------------------------------------------------ observer R1, in ticks */

struct dcmp_r1_setup {
    struct dcmp_tuning tuning;
    struct dcmp_step steps[DCMP_STEP_PERIODS_MAX]; /* of 1 to DCMP_STEP_PERIODS_MAX periods */
};

/* All 0: no sample yet. */
struct dcmp_r1 {
    struct dcmp_super_twisting state;
    int64_t tick; /* of the last sample */
    bool began;
};

/* Take the next sample, and return the estimate there. */
static inline struct dcmp_estimate dcmp_r1_update(struct dcmp_r1 *now, const struct dcmp_r1_setup *setup, int64_t tick,
                                                  real y, real voltage, real period)
{
    const int64_t gap = tick - now->tick;
    const real dt = dcmp_elapsed(now->tick, tick, period);
    const bool goes_on = now->began && gap >= 1 && gap <= DCMP_STEP_PERIODS_MAX;
    now->began = true;
    now->tick = tick;
    if (!goes_on) {
        const struct dcmp_estimate at_rest = {y, REAL(0.0), REAL(0.0)};
        now->state = dcmp_super_twisting_restart(y);
        return at_rest;
    }
    now->state =
        dcmp_super_twisting_update(now->state, setup->tuning, setup->steps[gap - 1], dt, y, voltage);
    return dcmp_super_twisting_estimate(now->state, setup->tuning);
}

/* ------------------------------------------------------------------------------------------ the friction filter, in ticks */

/* All 0: no sample yet. */
struct dcmp_friction_clock {
    int64_t tick; /* of the last sample */
    int64_t edge; /* of the last one that passed an edge */
    bool began;
};

static inline struct dcmp_friction_times dcmp_friction_times_at(struct dcmp_friction_clock clock, int64_t tick,
                                                                real period)
{
    const struct dcmp_friction_times none = {REAL(0.0), REAL(0.0)};
    const struct dcmp_friction_times times = {dcmp_elapsed(clock.tick, tick, period),
                                              dcmp_elapsed(clock.edge, tick, period)};
    return clock.began ? times : none;
}

/* The clock after the sample of a tick. */
static inline struct dcmp_friction_clock dcmp_friction_timed(struct dcmp_friction_clock clock, int64_t tick, bool edge)
{
    const struct dcmp_friction_clock next = {tick, edge ? tick : clock.edge, true};
    return next;
}

/* -------------------------------------------------------------------------------------------------------------- a cycle */

/* Of the device at one tick. */
struct dcmp_measurement {
    int64_t tick;
    real position; /* rad */
    real voltage;  /* V, really applied over the period that ended there */
};

/* What a run does not change; computed by the host. */
struct dcmp_cycle_setup {
    real period; /* s */
    bool delayed;       /* a command acts one period later */
    bool measured;      /* the controller gets the measured position */
    bool feedforward;   /* friction is a known input of the observer */
    bool knows_friction; /* the observer is the friction filter, not R1 */
    bool watched;       /* all monitors, not those of finite numbers alone */
    bool governed;      /* the reference has bounds */
    struct dcmp_r1_setup own;
    struct dcmp_friction_setup friction;
    struct dcmp_predictor predictor;
    struct dcmp_pd pd;
    real f1; /* rad/s2, of the friction that is fed forward */
    struct dcmp_outlier_setup outliers;
    struct dcmp_range range;
    struct dcmp_r1_setup second; /* the observer that watches */
    struct dcmp_watch_setup watch;
    struct dcmp_bounds bounds;
    struct dcmp_limiter_setup limiter;
    struct dcmp_polarity_setup polarity;
    struct dcmp_phases_setup phases;
};

struct dcmp_cycle {
    struct dcmp_outliers outliers;
    struct dcmp_r1 own;
    struct dcmp_friction_kalman friction;
    struct dcmp_friction_clock clock; /* of the friction filter */
    struct dcmp_r1 second;
    struct dcmp_watch watch;
    struct dcmp_governor governor;
    struct dcmp_limiter limiter;
    struct dcmp_polarity_check polarity;
    struct dcmp_phases phases;
    struct dcmp_trajectory trajectory;
    int64_t told;     /* tick of the last sample that friction was told for */
    real under_way;   /* V, sent and not applied yet */
    bool holds;       /* the trajectory stays where the arm was first */
    bool remembers;   /* the second observer has taken the newest sample */
    struct dcmp_estimate estimate;   /* of the newest sample */
    struct dcmp_reference reference; /* allowed, for the instant at which its command acts */
    real demand;                     /* V */
    struct dcmp_notes notes;         /* of this cycle */
};

/* The state before the first sample. */
static inline struct dcmp_cycle dcmp_cycle_begin(const struct dcmp_cycle_setup *setup)
{
    const struct dcmp_cycle first = {.limiter = dcmp_limiter_begin(&setup->limiter)};
    return first;
}

/* Whether a sample is to be left out, as if it had been lost: no arm can have got there. */
static inline bool dcmp_cycle_leaves_out(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                         struct dcmp_measurement sample)
{
    now->outliers = dcmp_outliers_take(now->outliers, setup->outliers, sample.tick, sample.position, setup->period);
    return now->outliers.off;
}

/* The observer's own estimate. */
static inline struct dcmp_estimate dcmp_cycle_observe(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                                      struct dcmp_measurement sample)
{
    if (!setup->knows_friction) {
        return dcmp_r1_update(&now->own, &setup->own, sample.tick, sample.position, sample.voltage, setup->period);
    }
    const struct dcmp_friction_times times = dcmp_friction_times_at(now->clock, sample.tick, setup->period);
    now->friction =
        dcmp_friction_kalman_update(now->friction, setup->friction, times, sample.position, sample.voltage);
    now->clock = dcmp_friction_timed(now->clock, sample.tick, now->friction.edge);
    return now->friction.estimate;
}

/* Go on with the polarity check, and tell of its result. */
static inline void dcmp_cycle_probe(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                    struct dcmp_measurement sample)
{
    now->polarity = dcmp_polarity_check(now->polarity, setup->polarity, sample.tick, sample.position, sample.voltage,
                                        setup->period);
    const bool over = now->polarity.stage == DCMP_POLARITY_OVER;
    if (over) {
        dcmp_tell(&now->notes, DCMP_NOTE_PROBE, now->polarity.gain.gain, now->polarity.gain.deviation);
    }
    dcmp_phases_probed(&now->phases, &setup->phases, sample.tick, now->polarity.objection, over,
                       now->polarity.voltage, &now->notes);
}

/* From the sample to the estimate, and to the phase of this cycle; whether the trajectory begins with it. Where friction is fed
 * forward: `before`, rad/s, is the reference's velocity in the middle between the last sample and this one, and `at` that at
 * the instant at which the command acts. */
static inline bool dcmp_cycle_sense(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                    struct dcmp_measurement sample, real before, real at)
{
    now->notes.count = 0u;
    struct dcmp_measurement told = sample;
    if (setup->feedforward) {
        const real held = sample.tick > now->told ? dcmp_known_friction(setup->f1, before) : REAL(0.0);
        now->told = sample.tick;
        told.voltage = dcmp_told_voltage(sample.voltage, held, setup->pd.volts);
    }
    now->estimate = dcmp_cycle_observe(now, setup, told);
    if (setup->feedforward) {
        now->estimate = dcmp_whole_estimate(now->estimate, dcmp_known_friction(setup->f1, at));
    }
    if (!now->holds) {
        now->holds = true;
        now->trajectory = dcmp_trajectory_hold(now->trajectory, now->estimate.position);
    }
    if (dcmp_has_authority(&now->phases)) {
        return false;
    }
    dcmp_phases_arm(&now->phases, &setup->phases, sample.tick, &now->notes);
    if (now->phases.phase == DCMP_RUN_PROBING) {
        dcmp_cycle_probe(now, setup, sample);
    }
    const bool begins = dcmp_phases_settled(&now->phases, &setup->phases, sample.tick, &now->notes);
    if (begins) {
        now->trajectory = dcmp_trajectory_begin(sample.tick, now->estimate.position);
    }
    return begins;
}

static inline void dcmp_cycle_tell_limit(struct dcmp_cycle *now, struct dcmp_limit_told told)
{
    if (told.limit != DCMP_LIMIT_NONE) {
        dcmp_tell(&now->notes, DCMP_NOTE_LIMIT + (int32_t)told.limit, told.first, told.second);
    }
}

/* What of a reference is allowed. */
static inline struct dcmp_reference dcmp_cycle_refer(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                                     struct dcmp_measurement sample, struct dcmp_reference asked)
{
    struct dcmp_reference allowed = asked;
    bool own = false;
    if (setup->governed) {
        const struct dcmp_governed governed =
            dcmp_governor_bound(now->governor, setup->bounds, asked, sample.tick, setup->period);
        now->governor = governed.next;
        allowed = governed.reference;
        own = governed.own;
    }
    dcmp_limit_reference(&now->limiter, &setup->limiter, sample.tick, sample.position, asked, allowed, own);
    dcmp_cycle_tell_limit(now, now->limiter.of_reference);
    return allowed;
}

/* The state at the instant at which the command acts. */
static inline struct dcmp_estimate dcmp_cycle_ahead(const struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                                    struct dcmp_measurement sample)
{
    struct dcmp_estimate ahead = now->estimate;
    if (setup->knows_friction) {
        ahead = dcmp_friction_ahead(now->friction, setup->friction, setup->delayed, setup->period, now->under_way,
                                    now->reference.velocity);
        ahead.position = setup->measured ? sample.position : ahead.position;
        return ahead;
    }
    ahead.position = setup->measured ? sample.position : ahead.position;
    return setup->delayed ? dcmp_ahead(ahead, setup->predictor, now->under_way) : ahead;
}

/* What the second observer objects to. */
static inline struct dcmp_objection dcmp_cycle_watch(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                                     struct dcmp_measurement sample)
{
    const struct dcmp_estimate seen = dcmp_r1_update(&now->second, &setup->second, sample.tick, sample.position,
                                                     sample.voltage, setup->period);
    now->watch = dcmp_watch_judge(now->watch, setup->watch, seen);
    const real figure = now->watch.cause == DCMP_CAUSE_WATCH_SPEED ? seen.velocity : now->watch.filtered;
    const struct dcmp_objection objection = {sample.tick, now->watch.cause, figure, REAL(0.0)};
    now->remembers = true;
    return objection;
}

/* The first of the checks that objects. */
static inline struct dcmp_objection dcmp_cycle_check(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                                     struct dcmp_measurement sample)
{
    struct dcmp_objection objection = {sample.tick, DCMP_CAUSE_NONE, REAL(0.0), REAL(0.0)};
    now->remembers = false;
    if (now->outliers.objection.cause != DCMP_CAUSE_NONE) {
        return now->outliers.objection;
    }
    if (!dcmp_all_finite(dcmp_instant(sample.tick, setup->period), sample.position, sample.voltage, now->estimate)) {
        objection.cause = DCMP_CAUSE_NUMBERS;
        return objection;
    }
    if (!setup->watched) {
        return objection;
    }
    objection.cause = dcmp_range_cause(setup->range, sample.position, now->estimate.velocity);
    if (objection.cause != DCMP_CAUSE_NONE) {
        objection.first = objection.cause == DCMP_CAUSE_SPEED ? now->estimate.velocity : sample.position;
        return objection;
    }
    return dcmp_cycle_watch(now, setup, sample);
}

/* From the trajectory's reference to the voltage to send, V. */
static inline real dcmp_cycle_act(struct dcmp_cycle *now, const struct dcmp_cycle_setup *setup,
                                  struct dcmp_measurement sample, struct dcmp_reference asked)
{
    now->reference = dcmp_cycle_refer(now, setup, sample, asked);
    now->demand = dcmp_pd_voltage(setup->pd, now->reference, dcmp_cycle_ahead(now, setup, sample));
    const struct dcmp_objection found = dcmp_cycle_check(now, setup, sample);
    dcmp_phases_judge(&now->phases, &setup->phases, sample.tick, found, now->demand, &now->notes);
    real voltage = REAL(0.0);
    if (dcmp_has_authority(&now->phases)) {
        voltage = dcmp_limit_voltage(&now->limiter, &setup->limiter, sample.tick, now->demand, now->phases.last);
        dcmp_cycle_tell_limit(now, now->limiter.of_voltage);
        dcmp_cycle_tell_limit(now, now->limiter.of_slew);
    } else {
        voltage = dcmp_partial_voltage(&now->phases, &setup->phases, sample.tick, now->demand);
    }
    now->under_way = dcmp_phases_send(&now->phases, voltage, now->limiter.objection, sample.tick, &now->notes);
    return now->under_way;
}

#endif
