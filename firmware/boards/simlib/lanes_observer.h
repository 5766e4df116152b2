/* The observer R1 of every lane. */
#ifndef LANES_OBSERVER_H
#define LANES_OBSERVER_H

#include "lanes_cycle.h"

static inline struct dcmp_super_twisting lanes_observer_state(const struct lanes_observer *o, int l)
{
    const struct dcmp_super_twisting now = {o->y[l], o->z1[l], o->z2[l], o->v1[l], o->v2[l], o->v3[l]};
    return now;
}

static inline struct dcmp_tuning lanes_tuning(const struct lanes_observer *o, double ku, int l)
{
    const struct dcmp_tuning tuning = {ku,      o->L1[l],  o->w1[l],        o->w2[l],
                                       o->M[l], o->mu0[l], o->floor_from[l]};
    return tuning;
}

static inline struct dcmp_step lanes_step(const struct lanes_observer *o, int l)
{
    const struct dcmp_step step = {o->f12[l], o->f22[l], o->gu1[l], o->gu2[l], o->h01[l], o->h02[l],
                                   o->h11[l], o->h12[l], o->k1[l],  o->k2[l],  o->k3[l]};
    return step;
}

static inline void lanes_keep_state(struct lanes_observer *o, struct dcmp_super_twisting next, int64_t take, int l)
{
    o->y[l] = take != 0 ? next.y : o->y[l];
    o->z1[l] = take != 0 ? next.z1 : o->z1[l];
    o->z2[l] = take != 0 ? next.z2 : o->z2[l];
    o->v1[l] = take != 0 ? next.v1 : o->v1[l];
    o->v2[l] = take != 0 ? next.v2 : o->v2[l];
    o->v3[l] = take != 0 ? next.v3 : o->v3[l];
}

struct lanes_estimates {
    double *x1;
    double *x2;
    double *w;
};

/* Replace the gains of those lanes of a group whose innovation is below the floor. */
static inline void lanes_slide(const struct lanes_observer *restrict o, const double *restrict ku,
                               const double *restrict dt, const double *restrict b, int from, double *restrict k1,
                               double *restrict k2, double *restrict k3)
{
    for (int i = 0; i < LANES_GROUP; i++) {
        const int l = from + i;
        const double size = dcmp_magnitude(b[i]);
        const struct dcmp_gains sliding = dcmp_sliding_gains(size, lanes_tuning(o, ku[l], l), dt[l]);
        k1[i] = size >= o->floor_from[l] ? k1[i] : sliding.k1;
        k2[i] = size >= o->floor_from[l] ? k2[i] : sliding.k2;
        k3[i] = size >= o->floor_from[l] ? k3[i] : sliding.k3;
    }
}

/* One step of the observer in a group of lanes. */
static inline void lanes_observe_group(struct lanes_observer *restrict o, const double *restrict ku,
                                       const struct lanes_cycle *restrict c, const double *restrict voltage, int from,
                                       struct lanes_estimates found)
{
    double z1[LANES_GROUP];
    double z2[LANES_GROUP];
    double v1[LANES_GROUP];
    double v2[LANES_GROUP];
    double b[LANES_GROUP];
    double k1[LANES_GROUP];
    double k2[LANES_GROUP];
    double k3[LANES_GROUP];
    int64_t slow = 0;
    for (int i = 0; i < LANES_GROUP; i++) {
        const int l = from + i;
        const struct dcmp_super_twisting ahead = dcmp_super_twisting_advance(
            lanes_observer_state(o, l), ku[l], lanes_step(o, l), c->dt[l], c->y[l], voltage[l]);
        z1[i] = ahead.z1;
        z2[i] = ahead.z2;
        v1[i] = ahead.v1;
        v2[i] = ahead.v2;
        b[i] = dcmp_innovation(ahead);
        k1[i] = o->k1[l];
        k2[i] = o->k2[l];
        k3[i] = o->k3[l];
        slow |= dcmp_magnitude(b[i]) >= o->floor_from[l] ? 0 : 1;
    }
    if (slow != 0) {
        lanes_slide(o, ku, c->dt, b, from, k1, k2, k3);
    }
    for (int i = 0; i < LANES_GROUP; i++) {
        const int l = from + i;
        const struct dcmp_super_twisting ahead = {c->y[l], z1[i], z2[i], v1[i], v2[i], o->v3[l]};
        const struct dcmp_gains gains = {k1[i], k2[i], k3[i]};
        const struct dcmp_super_twisting next = dcmp_super_twisting_correct(ahead, gains, b[i]);
        const struct dcmp_estimate estimate = dcmp_super_twisting_estimate(next, lanes_tuning(o, ku[l], l));
        lanes_keep_state(o, next, c->take[l], l);
        found.x1[l] = estimate.position;
        found.x2[l] = estimate.velocity;
        found.w[l] = estimate.disturbance;
    }
}

/* Begin again where a lane has no sample before this one, or the last is too long ago. */
static inline void lanes_restart(struct lanes_observer *o, const struct lanes_cycle *c, double longest_gap,
                                 struct lanes_estimates found)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        if (c->take[l] != 0 && !(c->dt[l] < longest_gap)) {
            lanes_keep_state(o, dcmp_super_twisting_restart(c->y[l]), 1, l);
            found.x1[l] = c->y[l];
            found.x2[l] = 0.0;
            found.w[l] = 0.0;
        }
    }
}

/* One step of the observer in every lane. */
static inline void lanes_observe(struct lanes_observer *o, const double *ku, const struct lanes_cycle *c,
                                 const double *voltage, struct lanes_estimates found)
{
    for (int from = 0; from < DCMP_LANES; from += LANES_GROUP) {
        lanes_observe_group(o, ku, c, voltage, from, found);
    }
}

#endif
