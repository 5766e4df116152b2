#include "dcmp_control.h"
#include "law_checks.h"

#define STEP_NUMBERS 11u

void CHECK(matched_gains)(const double *x, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const struct dcmp_gains gains = dcmp_matched_gains((real)x[i]);
        out[3u * i] = (double)gains.k1;
        out[3u * i + 1u] = (double)gains.k2;
        out[3u * i + 2u] = (double)gains.k3;
    }
}

static struct dcmp_step_lengths lengths_of(const double *x)
{
    const struct dcmp_step_lengths lengths = {(real)x[0], (real)x[1]};
    return lengths;
}

void CHECK(step_periods)(const double *lengths, const double *dt, int32_t *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        out[i] = dcmp_step_periods((real)dt[i], lengths_of(lengths));
    }
}

static struct dcmp_step step_of(const double *x)
{
    const struct dcmp_step step = {(real)x[0], (real)x[1], (real)x[2], (real)x[3], (real)x[4], (real)x[5],
                                   (real)x[6], (real)x[7], (real)x[8], (real)x[9], (real)x[10]};
    return step;
}

static void put(double *out, struct dcmp_estimate estimate)
{
    out[0] = (double)estimate.position;
    out[1] = (double)estimate.velocity;
    out[2] = (double)estimate.disturbance;
}

void CHECK(super_twisting)(const double *tuning, const double *steps, const double *others, const double *lengths,
                           const double *samples, double *out, uint32_t n)
{
    const struct dcmp_tuning gains = {(real)tuning[0], (real)tuning[1], (real)tuning[2], (real)tuning[3],
                                      (real)tuning[4], (real)tuning[5], (real)tuning[6]};
    struct dcmp_super_twisting state = dcmp_super_twisting_restart((real)0);
    double before = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        const double *sample = &samples[3u * i];
        const double dt = sample[0] - before; /* of double also for a float law: a clock has its own type */
        const int32_t periods = i == 0u ? DCMP_STEP_RESTART : dcmp_step_periods((real)dt, lengths_of(lengths));
        if (periods == DCMP_STEP_RESTART) {
            state = dcmp_super_twisting_restart((real)sample[1]);
        } else if (periods != DCMP_STEP_NONE) {
            const double *step = periods == DCMP_STEP_OTHER ? others : &steps[STEP_NUMBERS * (uint32_t)(periods - 1)];
            state = dcmp_super_twisting_update(state, gains, step_of(step), (real)dt, (real)sample[1], (real)sample[2]);
            others = periods == DCMP_STEP_OTHER ? &others[STEP_NUMBERS] : others;
        } else {
            continue;
        }
        before = sample[0];
        put(&out[3u * i], dcmp_super_twisting_estimate(state, gains));
    }
}

static struct dcmp_estimate estimate_of(const double *x)
{
    const struct dcmp_estimate estimate = {(real)x[0], (real)x[1], (real)x[2]};
    return estimate;
}

void CHECK(ahead)(const double *predictor, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_predictor by = {(real)predictor[0], (real)predictor[1], (real)predictor[2], (real)predictor[3]};
    for (uint32_t i = 0; i < n; i++) {
        put(&out[3u * i], dcmp_ahead(estimate_of(&rows[4u * i]), by, (real)rows[4u * i + 3u]));
    }
}

void CHECK(pd_voltage)(const double *pd, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_pd by = {(real)pd[0], (real)pd[1], (real)pd[2], (real)pd[3], (real)pd[4]};
    for (uint32_t i = 0; i < n; i++) {
        const double *row = &rows[6u * i];
        const struct dcmp_reference reference = {(real)row[0], (real)row[1], (real)row[2]};
        out[i] = (double)dcmp_pd_voltage(by, reference, estimate_of(&row[3]));
    }
}

void CHECK(known_friction)(double f1, double volts, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_estimate rest = {(real)2, (real)3, (real)1};
    for (uint32_t i = 0; i < n; i++) {
        const real friction = dcmp_known_friction((real)f1, (real)rows[2u * i]);
        out[5u * i] = (double)friction;
        out[5u * i + 1u] = (double)dcmp_told_voltage((real)rows[2u * i + 1u], friction, (real)volts);
        put(&out[5u * i + 2u], dcmp_whole_estimate(rest, friction));
    }
}
