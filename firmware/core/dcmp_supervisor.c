#include "dcmp_supervisor.h"

#define BOOT DCMP_BOOT
#define IDLE DCMP_IDLE
#define ARMING DCMP_ARMING
#define RUN DCMP_RUN
#define FAULT DCMP_FAULTED

static const uint8_t next_state[DCMP_EVENTS][DCMP_STATES] = {
    /*                          BOOT  IDLE    ARMING  RUN    FAULT */
    [DCMP_EVENT_TICK] =       {IDLE, IDLE,   ARMING, RUN,   FAULT},
    [DCMP_EVENT_ARM] =        {BOOT, ARMING, ARMING, RUN,   FAULT},
    [DCMP_EVENT_ARM_LAST] =   {BOOT, ARMING, RUN,    RUN,   FAULT},
    [DCMP_EVENT_DRIVE] =      {BOOT, IDLE,   IDLE,   RUN,   FAULT},
    [DCMP_EVENT_DISARM] =     {BOOT, IDLE,   IDLE,   IDLE,  FAULT},
    [DCMP_EVENT_CLEAR] =      {BOOT, IDLE,   IDLE,   IDLE,  IDLE},
    [DCMP_EVENT_RELEASE] =    {BOOT, IDLE,   IDLE,   IDLE,  FAULT},
    [DCMP_EVENT_SILENCE] =    {BOOT, IDLE,   IDLE,   FAULT, FAULT},
    [DCMP_EVENT_LINK_DOWN] =  {BOOT, IDLE,   IDLE,   FAULT, FAULT},
    [DCMP_EVENT_LIMIT] =      {BOOT, IDLE,   ARMING, FAULT, FAULT},
    [DCMP_EVENT_CORRUPTION] = {BOOT, IDLE,   ARMING, FAULT, FAULT},
    [DCMP_EVENT_STOP] =       {BOOT, FAULT,  FAULT,  FAULT, FAULT},
};

enum dcmp_state dcmp_supervisor_next(enum dcmp_state state, enum dcmp_event event)
{
    return (enum dcmp_state)next_state[event][state];
}

static void forget_fault(struct dcmp_supervisor *supervisor)
{
    const struct dcmp_fault none = {DCMP_NO_FAULT, 0, 0};
    supervisor->fault = none;
    supervisor->lowered = false;
}

void dcmp_supervisor_init(struct dcmp_supervisor *supervisor)
{
    supervisor->state = DCMP_BOOT;
    supervisor->counted = 0;
    forget_fault(supervisor);
}

void dcmp_supervisor_event(struct dcmp_supervisor *supervisor, enum dcmp_event event)
{
    supervisor->state = dcmp_supervisor_next(supervisor->state, event);
    if (supervisor->state != DCMP_FAULTED) {
        forget_fault(supervisor);
    }
    if (supervisor->state != DCMP_ARMING) {
        supervisor->counted = 0;
    }
}

bool dcmp_supervisor_raise(struct dcmp_supervisor *supervisor, enum dcmp_event event, const struct dcmp_fault *cause)
{
    const bool before = supervisor->state == DCMP_FAULTED;
    dcmp_supervisor_event(supervisor, event);
    if (before || supervisor->state != DCMP_FAULTED) {
        return false;
    }
    supervisor->fault = *cause;
    return true;
}

static enum dcmp_event classify(const struct dcmp_supervisor *supervisor, const struct dcmp_drive *drive, bool close)
{
    if (drive->release) {
        return DCMP_EVENT_RELEASE;
    }
    if (drive->clear && drive->voltage_mV == 0 && supervisor->lowered) {
        return DCMP_EVENT_CLEAR;
    }
    if (!drive->arm) {
        return DCMP_EVENT_DISARM;
    }
    if (drive->voltage_mV != 0) {
        return DCMP_EVENT_DRIVE;
    }
    if (supervisor->state != DCMP_ARMING) {
        return DCMP_EVENT_ARM; /* the first has nothing to be close to */
    }
    if (!close) {
        return DCMP_EVENT_DRIVE;
    }
    return supervisor->counted + 1u < DCMP_ARMING_DRIVES ? DCMP_EVENT_ARM : DCMP_EVENT_ARM_LAST;
}

void dcmp_supervisor_drive(struct dcmp_supervisor *supervisor, const struct dcmp_drive *drive, bool close)
{
    dcmp_supervisor_event(supervisor, classify(supervisor, drive, close));
    if (supervisor->state == DCMP_ARMING) {
        supervisor->counted++;
    }
    if (supervisor->state == DCMP_FAULTED && !drive->clear) {
        supervisor->lowered = true;
    }
}
