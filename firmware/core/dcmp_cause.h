/* Why a run ends: a number for each sentence of the checks that the core makes, and the figures in it. The words, and what to
 * look at first, are the host's (dcmp_hil/safety). */
#ifndef DCMP_CAUSE_H
#define DCMP_CAUSE_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_real.h"

enum dcmp_cause {
    DCMP_CAUSE_NONE = 0,
    DCMP_CAUSE_NUMBERS = 1,          /* not_finite: a number of sample or estimate */
    DCMP_CAUSE_DEMAND = 2,           /* not_finite: first: the demand, V */
    DCMP_CAUSE_SPEED = 3,            /* speed, by the run's observer; first: rad/s */
    DCMP_CAUSE_TRAVEL = 4,           /* travel; first: position, rad */
    DCMP_CAUSE_WATCH_SPEED = 5,      /* speed, by the supervisor's own observer; first: rad/s */
    DCMP_CAUSE_DISTURBANCE = 6,      /* disturbance; first: its 10 ms mean, rad/s2 */
    DCMP_CAUSE_JUMP = 7,             /* jump; first: its way, rad */
    DCMP_CAUSE_PROBE_NUMBERS = 8,    /* not_finite, while the arm is probed; first, second: position, voltage */
    DCMP_CAUSE_PROBE_MOVING = 9,     /* moving; first, second: way, rad, and time, s */
    DCMP_CAUSE_PROBE_SLEW = 10,      /* slew; first, second: voltage reached, V, and length of the push, s */
    DCMP_CAUSE_PROBE_POWER = 11,     /* power: no answer; first, second: ways up and down, rad */
    DCMP_CAUSE_PROBE_POLARITY = 12,  /* polarity; first, second: as above */
    DCMP_CAUSE_PROBE_UNSURE = 13,    /* power: too little to tell which way; first, second: as above */
    DCMP_CAUSE_PROBE_GAIN = 14,      /* gain; first, second: as above */
    DCMP_CAUSE_TRACKING = 15,        /* tracking; first, second: reference and position, rad */
    DCMP_CAUSE_SATURATION = 16,      /* saturation; first: the demand, V */
    DCMP_CAUSE_CHATTER = 17          /* chatter; first: its variation, V/s */
};

/* What a check objects to. All 0: nothing. */
struct dcmp_objection {
    int64_t tick;
    enum dcmp_cause cause;
    real first;
    real second;
};

/* Whether the end may take 50 ms: the voltage is led to 0 V. Every other cause is 0 V at once. */
static inline bool dcmp_leaves_time(enum dcmp_cause cause)
{
    return cause == DCMP_CAUSE_TRACKING || cause == DCMP_CAUSE_SATURATION || cause == DCMP_CAUSE_CHATTER;
}

#endif
