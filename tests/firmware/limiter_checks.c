#include "dcmp_limiter.h"
#include "law_checks.h"

void CHECK(limited)(double most, const double *x, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        out[i] = (double)dcmp_limited((real)most, (real)x[i]);
    }
}

void CHECK(slewed)(double step, const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++, rows += 2) {
        out[i] = (double)dcmp_slewed((real)step, (real)rows[0], (real)rows[1]);
    }
}

void CHECK(chatter)(const double *setup, const double *rows, double *out, uint32_t n)
{
    struct dcmp_chatter state = {0};
    for (uint32_t i = 0; i < n; i++, rows += 2, out += 2) {
        state = dcmp_chatter_judge(state, (real)setup[1], (int64_t)rows[0], (real)rows[1], (real)setup[0]);
        out[0] = state.found ? 1.0 : 0.0;
        out[1] = (double)state.mean;
    }
}

static struct dcmp_reference reference_of(const double *x)
{
    const struct dcmp_reference reference = {(real)x[0], (real)x[1], (real)x[2]};
    return reference;
}

static void put_told(double *out, struct dcmp_limit_told told)
{
    out[0] = (double)told.limit;
    out[1] = (double)told.first;
    out[2] = (double)told.second;
}

void CHECK(limiter)(const double *setup, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_limiter_setup limits = {
        (real)setup[0], (real)setup[1], (real)setup[2], (real)setup[3], (real)setup[4],     (real)setup[5],
        (real)setup[6], (real)setup[7], (real)setup[8], (int32_t)setup[9], setup[10] > 0.0,
    };
    struct dcmp_limiter state = dcmp_limiter_begin(&limits);
    real last = (real)0;
    for (uint32_t i = 0; i < n; i++, rows += 11, out += 16) {
        const int64_t tick = (int64_t)rows[0];
        dcmp_limit_reference(&state, &limits, tick, (real)rows[1], reference_of(&rows[2]), reference_of(&rows[5]),
                             rows[8] > 0.0);
        const bool whole = rows[10] > 0.0; /* authority */
        last = whole ? dcmp_limit_voltage(&state, &limits, tick, (real)rows[9], last) : (real)rows[9];
        out[0] = (double)last;
        put_told(&out[1], state.of_reference);
        put_told(&out[4], state.of_voltage);
        put_told(&out[7], state.of_slew);
        out[10] = (double)state.clamped;
        out[11] = (double)state.objection.cause;
        out[12] = (double)state.objection.tick;
        out[13] = (double)state.objection.first;
        out[14] = (double)state.objection.second;
        out[15] = (double)state.left;
    }
}
