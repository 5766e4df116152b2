/* What takes the voltage away. */
#ifndef DCMP_GUARD_H
#define DCMP_GUARD_H

#include <stdint.h>

#include "dcmp_device_state.h"

/* After every change of state: no voltage outside RUN. */
void dcmp_guard_settle(struct dcmp_device *device);

/* Something happened that may lead to FAULT. */
void dcmp_guard_raise(struct dcmp_device *device, enum dcmp_event event, enum dcmp_fault_code code, int32_t detail);

/* The owner is none any more, and its limits go with it. */
void dcmp_guard_end_session(struct dcmp_device *device);

/* Watchdog, link and lease: the transitions that time alone causes. */
void dcmp_guard_time(struct dcmp_device *device, uint32_t now_us);

/* Speed, travel and jumps, as of the newest count. */
void dcmp_guard_limits(struct dcmp_device *device);

#endif
