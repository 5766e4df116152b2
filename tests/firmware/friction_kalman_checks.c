#include "dcmp_friction_kalman.h"
#include "law_checks.h"

#define OUT_NUMBERS 34u

void CHECK(moved)(const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[9u * i];
        const struct dcmp_motion now = {(real)x[0], (real)x[1], (real)x[2], (real)x[3], (real)x[4], (real)0, (real)0};
        const struct dcmp_motion end = dcmp_moved(now, (real)x[5], (real)x[6], (real)x[7], (real)x[8]);
        const real values[6] = {end.x1, end.x2, end.d, end.s, end.a, end.direction};
        for (uint32_t k = 0; k < 6u; k++) {
            out[6u * i + k] = (double)values[k];
        }
    }
}

void CHECK(judged)(const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[9u * i];
        const struct dcmp_trust now = {(real)x[0], (real)x[1], (real)x[2], (real)x[3], (real)x[4], (real)x[5]};
        const struct dcmp_trust end = dcmp_judged(now, (real)x[6], (real)x[7], x[8] > 0.0);
        const real values[6] = {end.m, end.slope_m, end.calm, end.slow, end.fast, end.scatter};
        for (uint32_t k = 0; k < 6u; k++) {
            out[6u * i + k] = (double)values[k];
        }
    }
}

static void put(double *out, const struct dcmp_friction_kalman *filter, struct dcmp_estimate ahead)
{
    const struct dcmp_motion *state = &filter->state;
    const struct dcmp_covariance *p = &filter->covariance;
    const struct dcmp_trust *trust = &filter->trust;
    const real values[OUT_NUMBERS] = {
        filter->estimate.position, filter->estimate.velocity, filter->estimate.disturbance,
        state->x1, state->x2, state->d, state->f, state->s,
        p->p00, p->p01, p->p02, p->p03, p->p04, p->p11, p->p12, p->p13, p->p14, p->p22, p->p23, p->p24, p->p33, p->p34,
        p->p44, trust->m, trust->slope_m, trust->calm, trust->slow, trust->fast, trust->scatter,
        filter->sticks ? (real)1 : (real)0, (real)filter->steps, ahead.position, ahead.velocity, ahead.disturbance,
    };
    for (uint32_t k = 0; k < OUT_NUMBERS; k++) {
        out[k] = (double)values[k];
    }
}

void CHECK(friction_kalman)(const double *setup, double period, uint32_t delay, const double *rows, double *out,
                            uint32_t n)
{
    const struct dcmp_friction_setup by = {(real)setup[0], (real)setup[1], (real)setup[2],  (real)setup[3],
                                           (real)setup[4], (real)setup[5], (real)setup[6],  (real)setup[7],
                                           (real)setup[8], (real)setup[9], (real)setup[10], (real)setup[11]};
    struct dcmp_friction_kalman filter = dcmp_friction_begin(by, (real)rows[0], (real)rows[1]);
    for (uint32_t i = 0; i < n; i++) {
        const double *row = &rows[5u * i];
        if (i > 0u) {
            filter = dcmp_friction_kalman_update(filter, by, (real)row[0], (real)row[1], (real)row[2]);
        }
        put(&out[OUT_NUMBERS * i], &filter,
            dcmp_friction_ahead(filter, by, delay == 1u, (real)period, (real)row[3], (real)row[4]));
    }
}
