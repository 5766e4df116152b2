/* What the device says of its own accord, and how answers become frames. */
#ifndef DCMP_REPORT_H
#define DCMP_REPORT_H

#include "dcmp_device_state.h"

/* At the end of a tick: FAULT if it is due, SAMPLE, EDGE and HEALTH if they are. */
void dcmp_report_tick(struct dcmp_device *device, int16_t applied_mV, bool missed, const struct dcmp_edge *edge);

void dcmp_report_answer(const struct dcmp_device *device, const struct dcmp_answer *answer, struct dcmp_frame *frame);

#endif
