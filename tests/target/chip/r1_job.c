/* R1, predictor and PD, and the amplifier that they saturate. */
#include "dcmp_control.h"
#include "dcmp_plant.h"
#include "jobs.h"

/* The set-up of the job. */
struct r1_job_setup {
    struct dcmp_tuning tuning;
    struct dcmp_step steps[DCMP_STEP_PERIODS_MAX];
    struct dcmp_step_lengths lengths;
    struct dcmp_predictor predictor;
    struct dcmp_pd pd;
    real f1;      /* rad/s2 */
    real limit;   /* V */
    real slew;    /* V a period */
    real quantum; /* V */
};

/* The law alone: its state, and what a step gave. */
struct r1_law {
    struct dcmp_super_twisting observer;
    struct dcmp_estimate estimate;
    real voltage; /* V */
};

struct r1_state {
    struct r1_law law;
    struct dcmp_sim_amplifier_state amplifier;
    int32_t began;
};

void r1_step(const struct r1_job_setup *setup, const struct dcmp_step *step, struct r1_law *law,
             const struct job_row *row);

/* One step of the law with nothing around it: its instructions are counted. */
__attribute__((noinline)) void r1_step(const struct r1_job_setup *setup, const struct dcmp_step *step,
                                       struct r1_law *law, const struct job_row *row)
{
    const real friction = dcmp_known_friction(setup->f1, row->v_middle);
    const real told = dcmp_told_voltage(row->voltage, friction, setup->pd.volts);
    const struct dcmp_super_twisting next =
        dcmp_super_twisting_update(law->observer, setup->tuning, *step, row->gap, row->position, told);
    const struct dcmp_estimate rest = dcmp_super_twisting_estimate(next, setup->tuning);
    const struct dcmp_estimate whole = dcmp_whole_estimate(rest, friction);
    const struct dcmp_reference reference = {row->x, row->v, row->a};
    law->observer = next;
    law->estimate = whole;
    law->voltage = dcmp_pd_voltage(setup->pd, reference, dcmp_ahead(whole, setup->predictor, row->voltage));
}

/* The elementary functions of the numbers of a row. */
static void put_elementary(union job_result *out, const struct job_row *row)
{
    out[0].number = dcmp_floor(row->position);
    out[1].number = dcmp_sine(row->x);
    out[2].number = dcmp_exp(row->v);
    out[3].number = dcmp_square_root(row->a);
    out[4].number = dcmp_inverse_cube_root(dcmp_magnitude(row->x_middle));
    out[5].number = dcmp_expm1(row->position);
    out[6].number = dcmp_cosine(row->position);
}

static void put(union job_result *out, const struct r1_state *now, int32_t periods)
{
    out[0].number = now->law.estimate.position;
    out[1].number = now->law.estimate.velocity;
    out[2].number = now->law.estimate.disturbance;
    out[3].number = now->law.voltage;
    out[4].number = now->amplifier.output;
    out[5].whole = periods;
    out[6].number = now->law.observer.v1;
    out[7].number = now->law.observer.v2;
    out[8].number = now->law.observer.v3;
}

/* Take a row; return how many periods its step had. */
static int32_t take(const struct r1_job_setup *setup, struct r1_state *now, const struct job_row *row)
{
    const bool fresh = row->restarts != 0 || now->began == 0;
    const int32_t periods = fresh ? DCMP_STEP_RESTART : dcmp_step_periods(row->gap, setup->lengths);
    now->began = 1;
    if (periods == DCMP_STEP_RESTART) {
        now->law.observer = dcmp_super_twisting_restart(row->position);
        now->law.estimate = dcmp_super_twisting_estimate(now->law.observer, setup->tuning);
        now->law.voltage = REAL(0.0);
    } else if (periods != DCMP_STEP_NONE) {
        job_counts();
        r1_step(setup, &setup->steps[periods == DCMP_STEP_OTHER ? 0 : periods - 1], &now->law, row);
        job_counted();
    } else {
        /* time stands still */
    }
    return periods;
}

void r1_job(const void *setup, void *state, const struct job_row *rows, union job_result *out, uint32_t n)
{
    const struct r1_job_setup *by = setup;
    const struct dcmp_sim_amplifier amplifier = {by->limit, by->slew, by->quantum, by->quantum, REAL(1.0)};
    const struct dcmp_sim_amplifier_state off = {REAL(0.0), REAL(0.0), REAL(0.0), REAL(0.0), REAL(0.0)};
    struct r1_state *now = state;
    for (uint32_t i = 0; i < n; i++) {
        if (rows[i].restarts != 0) {
            now->amplifier = off;
        }
        const int32_t periods = take(by, now, &rows[i]);
        now->amplifier = dcmp_sim_amplifier_step(now->amplifier, amplifier, dcmp_sim_command(now->law.voltage));
        put(&out[JOB_RESULTS * i], now, periods);
        put_elementary(&out[JOB_RESULTS * i + 9u], &rows[i]);
    }
}
