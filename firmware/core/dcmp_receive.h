/* What the host's messages do. */
#ifndef DCMP_RECEIVE_H
#define DCMP_RECEIVE_H

#include "dcmp_device_state.h"

/* A frame that was found genuine. */
void dcmp_receive_message(struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us);

#endif
