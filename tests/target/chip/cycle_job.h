/* What the job of whole cycles is set up with. */
#ifndef CYCLE_JOB_H
#define CYCLE_JOB_H

#include "dcmp_cycle.h"

struct cycle_setup {
    struct dcmp_cycle_setup cycle;
    real delay;      /* s, from a sample to the instant at which its command acts */
    real soft_start; /* s */
};

#endif
