/* The state machine of docs/protocol.md, section 7: a table, and what its events need to remember. */
#ifndef DCMP_SUPERVISOR_H
#define DCMP_SUPERVISOR_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_message.h"

#define DCMP_STATES 5u
#define DCMP_ARMING_DRIVES 10u

enum dcmp_event {
    DCMP_EVENT_TICK,
    DCMP_EVENT_ARM,        /* DRIVE: arm, 0 V, close behind the one before */
    DCMP_EVENT_ARM_LAST,   /* the same, and the tenth of its kind */
    DCMP_EVENT_DRIVE,      /* DRIVE: arm, another voltage or further behind */
    DCMP_EVENT_DISARM,     /* DRIVE: no arm, nor a clear that counts */
    DCMP_EVENT_CLEAR,      /* DRIVE: clear, 0 V, after one without clear */
    DCMP_EVENT_RELEASE,    /* DRIVE: release */
    DCMP_EVENT_SILENCE,    /* the watchdog */
    DCMP_EVENT_LINK_DOWN,
    DCMP_EVENT_LIMIT,      /* speed, travel, jumps */
    DCMP_EVENT_CORRUPTION, /* too many corrupt frames */
    DCMP_EVENT_STOP,
    DCMP_EVENTS
};

struct dcmp_supervisor {
    enum dcmp_state state;
    struct dcmp_fault fault; /* the first cause */
    uint8_t counted;         /* DRIVEs while ARMING */
    bool lowered;            /* a DRIVE without clear came since the fault */
};

void dcmp_supervisor_init(struct dcmp_supervisor *supervisor);

/* The table. */
enum dcmp_state dcmp_supervisor_next(enum dcmp_state state, enum dcmp_event event);

/* An event that has no cause to remember. */
void dcmp_supervisor_event(struct dcmp_supervisor *supervisor, enum dcmp_event event);

/* An event that may lead to FAULT; true if it just did. */
bool dcmp_supervisor_raise(struct dcmp_supervisor *supervisor, enum dcmp_event event, const struct dcmp_fault *cause);

/* An accepted DRIVE; `close` if its seq is near enough to that of the one before. */
void dcmp_supervisor_drive(struct dcmp_supervisor *supervisor, const struct dcmp_drive *drive, bool close);

#endif
