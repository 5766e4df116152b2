#include "dcmp_polarity_check.h"
#include "law_checks.h"

static struct dcmp_polarity_setup setup_of(const double *x)
{
    const struct dcmp_polarity_setup setup = {(real)x[0], (real)x[1], (real)x[2], (real)x[3]};
    return setup;
}

void CHECK(polarity_check)(const double *setup, double period, const double *rows, double *out, uint32_t n)
{
    struct dcmp_polarity_check check = {0};
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[3u * i];
        check = dcmp_polarity_check(check, setup_of(setup), (int64_t)x[0], (real)x[1], (real)x[2], (real)period);
        const real values[8] = {
            (real)check.stage,     (real)check.objection.cause, check.objection.first, check.objection.second,
            check.voltage,         check.gain.gain,             check.gain.deviation,  check.found ? (real)1 : (real)0,
        };
        for (uint32_t k = 0; k < 8u; k++) {
            out[9u * i + k] = (double)values[k];
        }
        out[9u * i + 8u] = (double)check.objection.tick;
    }
}

void CHECK(motor_gain)(const double *setup, const double *rows, double *out, uint32_t n)
{
    struct dcmp_gain_fit fit = {0};
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[3u * i];
        fit = dcmp_gain_fit_add(fit, (real)setup[2], (real)x[0], (real)x[1], (real)x[2]);
        const struct dcmp_motor_gain gain = dcmp_fitted_gain(fit.out, setup_of(setup));
        out[3u * i] = (double)gain.gain;
        out[3u * i + 1u] = (double)gain.deviation;
        out[3u * i + 2u] = (double)fit.farthest;
    }
}

void CHECK(polarity_cause)(const double *setup, const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[4u * i];
        const struct dcmp_polarity_check check = {
            .gain = {(real)x[0], (real)x[1]}, .fit = {.farthest = (real)x[2]}, .reached = (real)x[3]};
        out[i] = (double)dcmp_polarity_cause(check, setup_of(setup));
    }
}
