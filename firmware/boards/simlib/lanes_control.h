/* Reference, governor, predictor and controller of every lane. */
#ifndef LANES_CONTROL_H
#define LANES_CONTROL_H

#include "lanes_cycle.h"

/* The position of a reference that fades in from x0: dcmp_hil/control/trajectory.py. */
static inline double lanes_faded(double fading, double gone, double x, double x0)
{
    const double faded = x0 + gone * (x - x0);
    return fading != 0.0 ? faded : x;
}

/* The voltage of the last period as the observer is told of it, with the known friction. */
static inline void lanes_tell(const struct lanes_row *row, const struct lanes_parameters *restrict p,
                              const struct lanes_state *restrict s, struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double faded = row->gone_middle * row->v_middle + row->gone1_middle * (row->x_middle - s->x0[l]);
        const double velocity = row->fading_middle != 0.0 ? faded : row->v_middle;
        const double held = c->tick > 0 ? dcmp_known_friction(p->f1[l], velocity) : 0.0;
        c->told[l] = dcmp_told_voltage(c->applied[l], held, p->volts[l]);
    }
}

/* The reference at t + delay, and its position at t where the cycle before did not look ahead to t. */
static inline void lanes_refer(const struct lanes_row *row, const struct lanes_state *restrict s,
                               struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double x0 = s->x0[l];
        const double v = row->gone * row->v + row->gone1 * (row->x - x0);
        const double a = row->gone * row->a + 2.0 * row->gone1 * row->v + row->gone2 * (row->x - x0);
        c->x[l] = lanes_faded(row->fading, row->gone, row->x, x0);
        c->v[l] = row->fading != 0.0 ? v : row->v;
        c->a[l] = row->fading != 0.0 ? a : row->a;
    }
}

/* The reference's position at t, for the figures: dcmp_hil/telemetry/block.py. */
static inline void lanes_align(const struct lanes_common *common, const struct lanes_row *row,
                               struct lanes_state *restrict s, struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double asked = lanes_faded(row->fading_now, row->gone_now, row->x_now, s->x0[l]);
        const double then = s->gap[l] == 1.0 && c->tick > 0 ? s->reference_x[l] : asked;
        c->x_now[l] = common->delayed != 0 ? then : c->x[l];
    }
}

/* Friction as it will act is part of the estimate; in the first cycle the trajectory has not begun. */
static inline void lanes_add_friction(const struct lanes_parameters *restrict p, struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double velocity = c->tick > 0 ? c->v[l] : 0.0;
        c->w[l] = c->w[l] + dcmp_known_friction(p->f1[l], velocity);
    }
}

/* Whether the reference may pass: dcmp_hil/safety/reference_governor.py. One that must be led is not for lanes. */
static inline int64_t lanes_govern(const struct lanes_parameters *restrict p, struct lanes_state *restrict s,
                                   struct lanes_cycle *restrict c)
{
    int64_t any = 0;
    for (int l = 0; l < DCMP_LANES; l++) {
        const double x = c->x[l];
        const double v = c->v[l];
        const double stopped = x + p->reference_stop[l] * v * dcmp_magnitude(v);
        const double farthest = p->reference_x_max[l];
        int64_t flag = dcmp_magnitude(x - s->reference_x[l]) <= p->reference_v_max[l] * c->dt[l] ? 0 : LANES_FLAG_JUMP;
        flag = dcmp_magnitude(v) <= p->reference_v_max[l] ? flag : LANES_FLAG_REPEAT;
        flag = dcmp_magnitude(c->a[l]) <= p->reference_a_max[l] ? flag : LANES_FLAG_REPEAT;
        flag = dcmp_magnitude(stopped) <= farthest ? flag : LANES_FLAG_REPEAT;
        flag = dcmp_magnitude(x) <= farthest ? flag : LANES_FLAG_REPEAT;
        flag = c->take[l] != 0 ? flag : 0;
        c->flags[l] |= flag;
        any |= flag;
    }
    return any;
}

/* A reference that jumps is left to the controller now and then, and not led. */
static inline void lanes_jump(const struct lanes_parameters *p, struct lanes_state *s, struct lanes_cycle *c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        if (c->take[l] != 0 && c->tick > 0 && (c->flags[l] & LANES_FLAG_JUMP) != 0) {
            const double size = dcmp_magnitude(c->x[l] - s->reference_x[l]);
            const bool small = size <= p->jump_x_max[l] &&
                               dcmp_magnitude(c->x[l]) + 0.4 * size <= p->reference_x_max[l];
            if (small && c->t - s->jumped[l] >= 0.5) {
                s->jumped[l] = c->t;
            } else {
                c->flags[l] |= LANES_FLAG_REPEAT;
            }
        }
        c->flags[l] &= ~(int64_t)LANES_FLAG_JUMP;
    }
}

/* Note an arm that is too far from its reference; for half a second, it ends the run. */
static inline void lanes_stray(const struct lanes_common *common, const struct lanes_parameters *restrict p,
                               struct lanes_state *restrict s, struct lanes_cycle *restrict c)
{
    const double t = c->t;
    for (int l = 0; l < DCMP_LANES; l++) {
        const int64_t away = dcmp_magnitude(c->x[l] - c->y[l]) <= p->error_max[l] ? 0 : c->take[l];
        const double began = t - s->astray_last[l] <= common->consecutive_gap ? s->astray_since[l] : t;
        const int64_t flag = t - began >= 0.5 ? LANES_FLAG_TRACKING : 0;
        s->astray_since[l] = away != 0 ? began : s->astray_since[l];
        s->astray_last[l] = away != 0 ? t : s->astray_last[l];
        c->flags[l] |= away != 0 ? flag : 0;
        s->reference_x[l] = c->take[l] != 0 ? c->x[l] : s->reference_x[l];
    }
}

/* Predictor and controller. */
static inline void lanes_command(const struct lanes_common *common, const struct lanes_parameters *restrict p,
                                 const struct lanes_state *restrict s, struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const struct dcmp_predictor predictor = {p->a[l], p->p1[l], p->p2[l], p->ku[l]};
        const struct dcmp_pd pd = {p->kp[l], p->kd[l], p->compensation[l], p->f0[l], p->volts[l]};
        const struct dcmp_reference reference = {c->x[l], c->v[l], c->a[l]};
        const double x1 = common->measured != 0 ? c->y[l] : c->x1[l];
        const struct dcmp_estimate now = {x1, c->x2[l], c->w[l]};
        const struct dcmp_estimate later = dcmp_ahead(now, predictor, s->sent[l]);
        const struct dcmp_estimate ahead = {common->delayed != 0 ? later.position : now.position,
                                            common->delayed != 0 ? later.velocity : now.velocity, now.disturbance};
        c->demand[l] = dcmp_pd_voltage(pd, reference, ahead);
    }
}

#endif
