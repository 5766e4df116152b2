/* Whole cycles: observer, controller, governor, supervisor and limits, as dcmp_cycle.h puts them together. */
#include "cycle_job.h"
#include "jobs.h"

struct cycle_state {
    struct dcmp_cycle cycle;
    int32_t began;
};

_Static_assert(sizeof(struct cycle_state) <= JOB_STATE_BYTES, "the state has its place in memory");

void cycle_step(const struct cycle_setup *setup, struct dcmp_cycle *now, const struct job_row *row,
                union job_result *found);

static struct dcmp_reference made(const struct cycle_setup *setup, const struct dcmp_cycle *now, int32_t tick,
                                  struct dcmp_reference raw)
{
    const struct dcmp_moment moment =
        dcmp_moment_after(now->trajectory, tick, setup->delay, setup->soft_start, setup->cycle.period);
    return dcmp_trajectory_at(now->trajectory, moment, setup->soft_start, raw);
}

static real velocity_between(const struct cycle_setup *setup, const struct dcmp_cycle *now, const struct job_row *row)
{
    const struct dcmp_reference raw = {row->x_middle, row->v_middle, REAL(0.0)};
    const struct dcmp_moment moment =
        dcmp_moment_between(now->trajectory, now->told, row->tick, setup->soft_start, setup->cycle.period);
    return dcmp_trajectory_at(now->trajectory, moment, setup->soft_start, raw).velocity;
}

/* One cycle with nothing around it: its instructions are counted. */
__attribute__((noinline)) void cycle_step(const struct cycle_setup *setup, struct dcmp_cycle *now,
                                          const struct job_row *row, union job_result *found)
{
    const struct dcmp_measurement sample = {row->tick, row->position, row->voltage};
    const struct dcmp_reference raw = {row->x, row->v, row->a};
    found[0].whole = 1;
    found[1].number = REAL(0.0);
    if (dcmp_cycle_leaves_out(now, &setup->cycle, sample)) {
        return;
    }
    const real before = velocity_between(setup, now, row);
    const real at = made(setup, now, row->tick, raw).velocity;
    found[0].whole = dcmp_cycle_sense(now, &setup->cycle, sample, before, at) ? 2 : 0;
    found[1].number = dcmp_cycle_act(now, &setup->cycle, sample, made(setup, now, row->tick, raw));
}

void cycle_job(const void *setup, void *state, const struct job_row *rows, union job_result *out, uint32_t n)
{
    const struct cycle_setup *by = setup;
    struct cycle_state *now = state;
    for (uint32_t i = 0; i < n; i++) {
        const struct job_row *row = &rows[i];
        union job_result *found = &out[JOB_RESULTS * i];
        if (row->restarts != 0 || now->began == 0) {
            now->cycle = dcmp_cycle_begin(&by->cycle);
        }
        now->began = 1;
        job_counts();
        cycle_step(by, &now->cycle, row, found);
        job_counted();
        const struct dcmp_cycle *cycle = &now->cycle;
        found[2].number = cycle->estimate.position;
        found[3].number = cycle->estimate.velocity;
        found[4].number = cycle->estimate.disturbance;
        found[5].number = cycle->reference.position;
        found[6].number = cycle->reference.velocity;
        found[7].number = cycle->reference.acceleration;
        found[8].number = cycle->demand;
        found[9].whole = (int32_t)cycle->phases.phase;
        found[10].whole = (int32_t)cycle->notes.count;
        found[11].number = cycle->polarity.gain.gain;
        found[12].number = cycle->watch.filtered;
        found[13].number = cycle->second.state.v2;
        found[14].number = cycle->limiter.of_voltage.first;
        found[15].whole = (int32_t)cycle->outliers.off;
    }
}
