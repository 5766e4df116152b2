#include "dcmp_monitors.h"
#include "law_checks.h"

void CHECK(outliers)(const double *setup, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_outlier_setup limits = {(real)setup[1], (real)setup[2], (real)setup[3]};
    struct dcmp_outliers state = {0};
    for (uint32_t i = 0; i < n; i++, rows += 2, out += 5) {
        state = dcmp_outliers_take(state, limits, (int64_t)rows[0], (real)rows[1], (real)setup[0]);
        out[0] = state.off ? 1.0 : 0.0;
        out[1] = (double)state.count;
        out[2] = (double)state.objection.cause;
        out[3] = (double)state.objection.tick;
        out[4] = (double)state.objection.first;
    }
}

static struct dcmp_estimate estimate_of(const double *x)
{
    const struct dcmp_estimate estimate = {(real)x[0], (real)x[1], (real)x[2]};
    return estimate;
}

void CHECK(all_finite)(const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++, rows += 6) {
        out[i] = dcmp_all_finite((real)rows[0], (real)rows[1], (real)rows[2], estimate_of(&rows[3])) ? 1.0 : 0.0;
    }
}

void CHECK(range)(const double *setup, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_range range = {(real)setup[0], (real)setup[1]};
    for (uint32_t i = 0; i < n; i++, rows += 2) {
        out[i] = (double)dcmp_range_cause(range, (real)rows[0], (real)rows[1]);
    }
}

void CHECK(watch)(const double *setup, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_watch_setup limits = {(real)setup[0], (real)setup[1], (real)setup[2], (int32_t)setup[3]};
    struct dcmp_watch state = {0};
    for (uint32_t i = 0; i < n; i++, rows += 3, out += 3) {
        state = dcmp_watch_judge(state, limits, estimate_of(rows));
        out[0] = (double)state.cause;
        out[1] = (double)state.filtered;
        out[2] = (double)state.above;
    }
}
