/* From the parameters of a run to the set-up of its cycle, in double or single precision. */
#ifndef RUN_SETUP_H
#define RUN_SETUP_H

#include <stdbool.h>

#include "dcmp_cycle.h"
#include "run.h"

#define RUN_GAP_PERIODS_MAX 2.5 /* between two cycles of one condition */

static inline struct dcmp_r1_setup run_observer_of(const struct run_observer *from, real ku)
{
    struct dcmp_r1_setup to = {
        .tuning = {ku, REAL(from->L1), REAL(from->w1), REAL(from->w2), REAL(from->M), REAL(from->mu0),
                   REAL(from->floor_from)}};
    for (int gap = 0; gap < RUN_GAPS; gap++) {
        const double *n = &from->steps[gap * RUN_STEP_NUMBERS];
        const struct dcmp_step step = {REAL(n[0]), REAL(n[1]), REAL(n[2]), REAL(n[3]), REAL(n[4]), REAL(n[5]),
                                       REAL(n[6]), REAL(n[7]), REAL(n[8]), REAL(n[9]), REAL(n[10])};
        to.steps[gap] = step;
    }
    return to;
}

static inline struct dcmp_limiter_setup run_limiter_of(const struct run_parameters *p)
{
    const struct dcmp_limiter_setup limiter = {
        .period = REAL(p->period),
        .gap = REAL(RUN_GAP_PERIODS_MAX * p->period),
        .voltage = REAL(p->amplifier_limit),
        .step = REAL(p->slew),
        .position = REAL(p->reference_x_max),
        .velocity = REAL(p->reference_v_max),
        .acceleration = REAL(p->reference_a_max),
        .error = REAL(p->error_max),
        .chatter = REAL(p->chatter_max),
        .block = (p->watched != 0) ? (int32_t)p->chatter_cycles : 0,
        .slews = p->slew < __builtin_inf(),
    };
    return limiter;
}

static inline struct dcmp_cycle_setup run_setup_of(const struct run_parameters *p)
{
    const struct run_friction *f = &p->friction;
    const struct dcmp_cycle_setup setup = {
        .period = REAL(p->period),
        .delayed = p->delay_samples == 1.0,
        .measured = p->measured != 0,
        .feedforward = p->feedforward != 0,
        .knows_friction = p->observer_kind == (int64_t)RUN_FRICTION_KALMAN,
        .watched = p->watched != 0,
        .governed = p->governed != 0,
        .own = run_observer_of(&p->own, REAL(p->ku)),
        .friction = {REAL(f->friction_f0), REAL(f->friction_gravity), REAL(f->friction_ku), REAL(f->friction_f1),
                     REAL(f->friction_f_max), REAL(f->friction_f1_variance), REAL(f->friction_q),
                     REAL(f->friction_half_count), REAL(f->friction_restart_after),
                     REAL(f->friction_unchanged_variance), REAL(f->friction_edge_variance),
                     REAL(f->friction_d_noise)},
        .predictor = {REAL(p->a), REAL(p->p1), REAL(p->p2), REAL(p->ku)},
        .pd = {REAL(p->kp), REAL(p->kd), REAL(p->compensation), REAL(p->f0), REAL(p->volts)},
        .f1 = REAL(p->f1),
        .outliers = {REAL(p->jump_speed), REAL(p->jump_floor), REAL(p->jump_usual)},
        .range = {REAL(p->position_max), REAL(p->velocity_max)},
        .second = run_observer_of(&p->watch, REAL(p->ku)),
        .watch = {REAL(p->velocity_max), REAL(p->disturbance_keep), REAL(p->disturbance_max),
                  (int32_t)p->disturbance_cycles},
        .bounds = {REAL(p->reference_x_max), REAL(p->reference_v_max), REAL(p->reference_a_max),
                   REAL(p->reference_braking), REAL(p->reference_stop), REAL(p->reference_strongest)},
        .limiter = run_limiter_of(p),
        .polarity = {REAL(p->probe_ku), REAL(p->probe_voltage), REAL(p->probe_gravity), REAL(p->count)},
        .phases = {REAL(p->period), REAL(p->settle), REAL(p->engage), REAL(p->amplifier_limit), REAL(p->slew),
                   p->probes != 0},
    };
    return setup;
}

#endif
