/* The law in single precision in a loop with the simulated rig, which is in double: what is computed in float is not exact, but
 * an arm is. */
#include "dcmp_plant.h"
#include "jobs.h"
#include "run.h"

#define RATE 0.5 /* rad/s, of the reference sin(t / 2) */

/* Run n cycles; rows and results are those of the job, and errors are position minus reference, rad, since the trajectory began. */
int64_t closed_loop(const struct run_parameters *p, const void *setup, void *state, struct job_row *rows,
                    union job_result *results, double *errors, int64_t n);

static float value(double since)
{
    return (float)dcmp_sine(RATE * since);
}

static float slope(double since)
{
    return (float)(RATE * dcmp_cosine(RATE * since));
}

int64_t closed_loop(const struct run_parameters *p, const void *setup, void *state, struct job_row *rows,
                    union job_result *results, double *errors, int64_t n)
{
    const struct dcmp_plant_model model = {p->plant_f0,  p->plant_f1,           p->plant_gravity, p->plant_ku,
                                           p->plant_eta, p->plant_eta_amplitude, p->plant_eta_rate};
    const struct dcmp_sim_encoder encoder = {p->count, p->phase, 0.0};
    const struct dcmp_sim_amplifier amplifier = {p->amplifier_limit, p->amplifier_slew, p->dead_zone, p->quantum,
                                                 p->delay_samples};
    struct dcmp_plant arm = {p->plant_position, 0.0, 0.0};
    struct dcmp_sim_amplifier_state output = {0.0, 0.0, 0.0, 0.0, 0.0};
    int64_t began = -1;
    for (int64_t tick = 0; tick < n; tick++) {
        struct job_row *row = &rows[tick];
        const double since = began < 0 ? 0.0 : (double)(tick - began) * p->period;
        const double middle = since - 0.5 * p->period;
        row->tick = (int32_t)tick;
        row->position = (float)dcmp_sim_encoder_read(encoder, arm.position, 0.0);
        row->voltage = (float)output.output;
        row->gap = (float)p->period;
        row->x = value(since + p->delay);
        row->v = slope(since + p->delay);
        row->a = (float)(-RATE * RATE) * row->x;
        row->x_middle = value(middle);
        row->v_middle = slope(middle);
        cycle_job(setup, state, row, &results[JOB_RESULTS * tick], 1u);
        errors[tick] = arm.position - dcmp_sine(RATE * since);
        began = results[JOB_RESULTS * tick].whole == 2 ? tick : began;
        output = dcmp_sim_amplifier_step(output, amplifier, (double)results[JOB_RESULTS * tick + 1].number);
        arm = dcmp_plant_advance(arm, model, p->plant_step, p->plant_steps, tick, output.output);
    }
    return began;
}
