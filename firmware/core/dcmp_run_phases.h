/* The phases of a run and its authority: dcmp_hil/safety/supervisor.py, with the same conditions in the same order.
 * What the checks find, the limits make and the polarity check wants are the caller's, who hands them in. */
#ifndef DCMP_RUN_PHASES_H
#define DCMP_RUN_PHASES_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_cause.h"
#include "dcmp_limiter.h"
#include "dcmp_time.h"

enum dcmp_run_phase {
    DCMP_RUN_ARMING = 0,
    DCMP_RUN_PROBING = 1,
    DCMP_RUN_SETTLING = 2,
    DCMP_RUN_ENGAGING = 3,
    DCMP_RUN_RUNNING = 4,
    DCMP_RUN_STOPPING = 5,
    DCMP_RUN_TRIPPED = 6
};

struct dcmp_phases_setup {
    real period;        /* s */
    real settle;        /* s at 0 V */
    real engage;        /* s, over which authority grows */
    real voltage_limit; /* V, either way */
    real slew;          /* V a period; infinity for none */
    bool probes;        /* there is a polarity check */
};

/* All 0 at the start. */
struct dcmp_phases {
    int64_t since; /* tick at which the present phase began */
    enum dcmp_run_phase phase;
    bool over;    /* 0 V for good */
    bool orderly; /* the voltage was led there */
    real push;    /* V, of the polarity check */
    real last;    /* V, what was sent last */
    real stop_from; /* V, where an orderly end begins */
    struct dcmp_objection refusal; /* of the polarity check */
    struct dcmp_objection cause;   /* the first */
};

#define DCMP_RAMP_TIME REAL(0.05) /* s that an orderly end takes to 0 V */

/* What a cycle has to tell, in its order; a cycle has fewer than there are places. */
#define DCMP_NOTES_MAX 16u

#define DCMP_NOTE_PHASE 1 /* first: the new phase */
#define DCMP_NOTE_PROBE 2 /* first, second: gain and its deviation, (rad/s2)/V */
#define DCMP_NOTE_LIMIT 2 /* plus enum dcmp_limit, 1 to 6; first, second: as there */

struct dcmp_note {
    int32_t code;
    real first;
    real second;
};

struct dcmp_notes {
    struct dcmp_note note[DCMP_NOTES_MAX];
    uint32_t count;
};

static inline void dcmp_tell(struct dcmp_notes *notes, int32_t code, real first, real second)
{
    const struct dcmp_note note = {code, first, second};
    notes->note[notes->count % DCMP_NOTES_MAX] = note;
    notes->count++;
}

/* Whether there is full authority: the limits have the last word. */
static inline bool dcmp_has_authority(const struct dcmp_phases *now)
{
    return now->phase == DCMP_RUN_RUNNING;
}

static inline void dcmp_phases_enter(struct dcmp_phases *now, enum dcmp_run_phase next, int64_t tick,
                                     struct dcmp_notes *notes)
{
    now->phase = next;
    now->since = tick;
    now->stop_from = dcmp_magnitude(now->last);
    dcmp_tell(notes, DCMP_NOTE_PHASE, REAL((int32_t)next), REAL(0.0));
}

/* Begin to end the run at a tick; the first cause stays. */
static inline void dcmp_phases_stop(struct dcmp_phases *now, struct dcmp_objection objection, int64_t tick,
                                    struct dcmp_notes *notes)
{
    const bool leads = now->phase == DCMP_RUN_ENGAGING || now->phase == DCMP_RUN_RUNNING;
    const bool led = now->phase == DCMP_RUN_STOPPING;
    if (now->cause.cause == DCMP_CAUSE_NONE) {
        now->cause = objection;
    }
    if (now->phase == DCMP_RUN_TRIPPED) {
        return;
    }
    if (!dcmp_leaves_time(objection.cause)) {
        dcmp_phases_enter(now, DCMP_RUN_TRIPPED, tick, notes);
        now->over = true;
    } else if (leads) {
        dcmp_phases_enter(now, DCMP_RUN_STOPPING, tick, notes);
    } else if (!led) {
        dcmp_phases_enter(now, DCMP_RUN_TRIPPED, tick, notes); /* nothing to lead to 0 V */
        now->over = true;
    } else {
        /* It is on its way. */
    }
}

/* Leave ARMING with the first sample. */
static inline void dcmp_phases_arm(struct dcmp_phases *now, const struct dcmp_phases_setup *setup, int64_t tick,
                                   struct dcmp_notes *notes)
{
    if (now->phase == DCMP_RUN_ARMING) {
        dcmp_phases_enter(now, setup->probes ? DCMP_RUN_PROBING : DCMP_RUN_SETTLING, tick, notes);
    }
}

/* Go on probing: what the polarity check says of a sample, whether it is over and all is well, and the voltage that it wants, V.
 * A refusal waits for what the checks find in this cycle: a jump is no motion of the arm. */
static inline void dcmp_phases_probed(struct dcmp_phases *now, const struct dcmp_phases_setup *setup, int64_t tick,
                                      struct dcmp_objection refusal, bool over, real voltage, struct dcmp_notes *notes)
{
    if (refusal.cause != DCMP_CAUSE_NONE) {
        now->refusal = refusal;
    } else if (over) {
        dcmp_phases_enter(now, DCMP_RUN_SETTLING, tick, notes);
    } else {
        now->push = dcmp_limited(setup->voltage_limit, voltage);
    }
}

/* Leave SETTLING in time; whether the trajectory begins. */
static inline bool dcmp_phases_settled(struct dcmp_phases *now, const struct dcmp_phases_setup *setup, int64_t tick,
                                       struct dcmp_notes *notes)
{
    if (now->phase == DCMP_RUN_SETTLING && dcmp_elapsed(now->since, tick, setup->period) >= setup->settle) {
        dcmp_phases_enter(now, DCMP_RUN_ENGAGING, tick, notes);
        return true;
    }
    return false;
}

/* Leave PROBING where the polarity check has refused, ENGAGING with full authority, STOPPING with none. */
static inline void dcmp_phases_leave(struct dcmp_phases *now, const struct dcmp_phases_setup *setup, int64_t tick,
                                     struct dcmp_notes *notes)
{
    if (now->refusal.cause != DCMP_CAUSE_NONE) {
        dcmp_phases_stop(now, now->refusal, tick, notes);
    }
    const real gone = dcmp_elapsed(now->since, tick, setup->period);
    if (now->phase == DCMP_RUN_ENGAGING && gone >= setup->engage) {
        dcmp_phases_enter(now, DCMP_RUN_RUNNING, tick, notes);
    } else if (now->phase == DCMP_RUN_STOPPING && gone >= DCMP_RAMP_TIME) {
        dcmp_phases_enter(now, DCMP_RUN_TRIPPED, tick, notes);
        now->over = true;
        now->orderly = true;
    } else {
        /* It stays. */
    }
}

/* What the checks of a cycle object to, then what the controller asks for, then time. */
static inline void dcmp_phases_judge(struct dcmp_phases *now, const struct dcmp_phases_setup *setup, int64_t tick,
                                     struct dcmp_objection objection, real demand, struct dcmp_notes *notes)
{
    if (objection.cause != DCMP_CAUSE_NONE) {
        dcmp_phases_stop(now, objection, tick, notes);
    }
    if (!dcmp_is_finite(demand)) {
        const struct dcmp_objection no_number = {tick, DCMP_CAUSE_DEMAND, demand, REAL(0.0)};
        dcmp_phases_stop(now, no_number, tick, notes);
    }
    dcmp_phases_leave(now, setup, tick, notes);
}

/* The voltage in every phase but RUNNING, V. */
static inline real dcmp_partial_voltage(const struct dcmp_phases *now, const struct dcmp_phases_setup *setup,
                                        int64_t tick, real demand)
{
    const real gone = dcmp_elapsed(now->since, tick, setup->period);
    real most = REAL(0.0);
    if (now->phase == DCMP_RUN_PROBING) {
        return now->push;
    }
    if (now->phase == DCMP_RUN_ENGAGING) {
        most = setup->voltage_limit * gone / setup->engage; /* NaN of an infinite limit at once: that is 0 V */
    } else if (now->phase == DCMP_RUN_STOPPING) {
        most = now->stop_from * (REAL(1.0) - gone / DCMP_RAMP_TIME);
    } else {
        /* 0 V */
    }
    if (!(most > REAL(0.0))) {
        return REAL(0.0);
    }
    return dcmp_slewed(setup->slew, dcmp_limited(most, demand), now->last);
}

/* What is sent, V: it was limited, and the limits may object. Without authority nothing is to be led to 0 V. */
static inline real dcmp_phases_send(struct dcmp_phases *now, real voltage, struct dcmp_objection objection, int64_t tick,
                                    struct dcmp_notes *notes)
{
    now->last = voltage;
    if (objection.cause != DCMP_CAUSE_NONE) {
        dcmp_phases_stop(now, objection, tick, notes);
        now->last = now->over ? REAL(0.0) : voltage;
    }
    return now->last;
}

#endif
