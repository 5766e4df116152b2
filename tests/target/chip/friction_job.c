/* The friction filter with its predictor. */
#include "dcmp_friction_kalman.h"
#include "jobs.h"

struct friction_state {
    struct dcmp_friction_kalman filter;
    real edge; /* s, since the last sample that passed an edge */
    int32_t began;
};

void friction_step(const struct dcmp_friction_setup *setup, struct friction_state *now, const struct job_row *row,
                   union job_result *found);

/* One step with nothing around it: its instructions are counted. */
__attribute__((noinline)) void friction_step(const struct dcmp_friction_setup *setup, struct friction_state *now,
                                             const struct job_row *row, union job_result *found)
{
    const struct dcmp_friction_times times = {row->gap, now->edge + row->gap};
    now->filter = dcmp_friction_kalman_update(now->filter, *setup, times, row->position, row->voltage);
    now->edge = now->filter.edge ? REAL(0.0) : times.edge;
    const struct dcmp_estimate ahead =
        dcmp_friction_ahead(now->filter, *setup, true, row->gap, row->voltage, row->v);
    found[3].number = ahead.position;
    found[4].number = ahead.velocity;
    found[5].number = ahead.disturbance;
}

void friction_job(const void *setup, void *state, const struct job_row *rows, union job_result *out, uint32_t n)
{
    struct friction_state *now = state;
    for (uint32_t i = 0; i < n; i++) {
        const struct job_row *row = &rows[i];
        union job_result *found = &out[JOB_RESULTS * i];
        if (row->restarts != 0 || now->began == 0) {
            now->edge = REAL(0.0);
            now->filter = dcmp_friction_begin(*(const struct dcmp_friction_setup *)setup, row->position);
        }
        now->began = 1;
        job_counts();
        friction_step(setup, now, row, found);
        job_counted();
        const struct dcmp_friction_kalman *filter = &now->filter;
        found[0].number = filter->estimate.position;
        found[1].number = filter->estimate.velocity;
        found[2].number = filter->estimate.disturbance;
        found[6].number = filter->state.f;
        found[7].number = filter->state.s;
        found[8].number = filter->covariance.p00;
        found[9].number = filter->covariance.p12;
        found[10].number = filter->covariance.p22;
        found[11].number = filter->covariance.p34;
        found[12].number = filter->trust.m;
        found[13].number = filter->trust.scatter;
        found[14].whole = (int32_t)filter->steps;
        found[15].whole = filter->sticks ? 1 : 0;
    }
}
