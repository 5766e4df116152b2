/* The core's packing and unpacking, of what a device sends and of what it receives. */
#ifndef FUZZ_CODEC_H
#define FUZZ_CODEC_H

#include <stdbool.h>

#include "dcmp_frame.h"

/* Whether a genuine frame of any message is the same after it was unpacked and packed again, its bits without a name at 0. */
bool codec_returns(const struct dcmp_frame *frame);

#endif
