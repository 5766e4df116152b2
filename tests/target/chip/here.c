/* What jobs need besides on this computer: nothing is counted, and the host makes the set-up of a cycle. */
#include "cycle_job.h"
#include "jobs.h"
#include "run_setup.h"

uint32_t cycle_setup_of(const struct run_parameters *parameters, struct cycle_setup *setup);

void job_counts(void)
{
}

void job_counted(void)
{
}

/* Make the set-up; return its bytes. */
uint32_t cycle_setup_of(const struct run_parameters *parameters, struct cycle_setup *setup)
{
    setup->cycle = run_setup_of(parameters);
    setup->delay = REAL(parameters->delay);
    setup->soft_start = REAL(parameters->soft_start);
    return (uint32_t)sizeof *setup;
}
