#include "dcmp_friction_kalman.h"
#include "law_checks.h"

#define OUT_NUMBERS 34u
#define EDGE_NUMBERS 33u
#define EDGE_OUT_NUMBERS 28u /* without estimate and prediction */

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

void CHECK(stepped)(const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        out[i] = dcmp_stepped((real)rows[2u * i], (real)rows[2u * i + 1u]) ? 1.0 : 0.0;
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

static struct dcmp_friction_setup setup_of(const double *x)
{
    const struct dcmp_friction_setup setup = {(real)x[0], (real)x[1], (real)x[2], (real)x[3], (real)x[4],  (real)x[5],
                                              (real)x[6], (real)x[7], (real)x[8], (real)x[9], (real)x[10], (real)x[11]};
    return setup;
}

void CHECK(by_edge)(const double *setup, const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[EDGE_NUMBERS * i];
        const double *p = &x[5];
        const double *trust = &x[20];
        double every[OUT_NUMBERS];
        struct dcmp_friction_kalman filter = {
            .state = {(real)x[0], (real)x[1], (real)x[2], (real)x[3], (real)x[4], (real)x[26], (real)0},
            .covariance = {(real)p[0], (real)p[1], (real)p[2], (real)p[3], (real)p[4], (real)p[5], (real)p[6], (real)p[7],
                           (real)p[8], (real)p[9], (real)p[10], (real)p[11], (real)p[12], (real)p[13], (real)p[14]},
            .trust = {(real)trust[0], (real)trust[1], (real)trust[2], (real)trust[3], (real)trust[4], (real)trust[5]},
            .sticks = x[27] > 0.0,
            .y = (real)x[30],
        };
        const struct dcmp_friction_times times = {(real)x[32], (real)x[28] - (real)x[29]};
        filter = dcmp_by_edge(filter, setup_of(setup), (real)x[31], times);
        put(every, &filter, filter.estimate);
        for (uint32_t k = 0; k < EDGE_OUT_NUMBERS; k++) {
            out[EDGE_OUT_NUMBERS * i + k] = every[k + 3u];
        }
    }
}

void CHECK(friction_kalman)(const double *setup, double period, uint32_t delay, const double *rows, double *out,
                            uint32_t n)
{
    const struct dcmp_friction_setup by = setup_of(setup);
    struct dcmp_friction_kalman filter = dcmp_friction_begin(by, (real)rows[1]);
    double before = rows[0];
    double edge = rows[0];
    for (uint32_t i = 0; i < n; i++) {
        const double *row = &rows[5u * i];
        if (i > 0u) {
            const struct dcmp_friction_times times = {(real)(row[0] - before), (real)(row[0] - edge)};
            filter = dcmp_friction_kalman_update(filter, by, times, (real)row[1], (real)row[2]);
            before = row[0];
            edge = filter.edge ? row[0] : edge;
        }
        put(&out[OUT_NUMBERS * i], &filter,
            dcmp_friction_ahead(filter, by, delay == 1u, (real)period, (real)row[3], (real)row[4]));
    }
}
