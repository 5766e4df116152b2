/* Loops too long for Python: exhaustive bit flips, garbage, silence,
 * wrong counts. */
#ifndef CORE_CHECKS_H
#define CORE_CHECKS_H

#include "dcmp_device_state.h"
#include "dcmp_crc.h"
#include "dcmp_guard.h"
#include "dcmp_port.h"
#include "dcmp_protocol_hash.h"
#include "dcmp_receive.h"
#include "dcmp_report.h"

struct flips {
    uint32_t tried;
    uint32_t passed; /* came through as a genuine message other than the original */
    uint32_t drives; /* of those, DRIVEs that the device accepted */
    uint32_t lost;   /* the second good frame behind the damaged one did not come through */
};

uint32_t check_protocol_hash(void);
uint32_t check_device_size(void);

/* All flips of one bit, or of two, of an encoded frame (`marker` is another, undamaged one). A device in RUN that would
 * accept the original is `device`. */
struct flips check_stream_flips(enum dcmp_carrier carrier, const struct dcmp_device *device,
                                const struct dcmp_frame *frame, const struct dcmp_frame *marker, bool two);

/* The same of a CAN frame's identifier (11 bits) and payload. */
struct flips check_can_flips(const struct dcmp_frame *frame, bool two);

/* Garbage with ticks in between; returns how often the device left IDLE, put something out or drove. */
uint32_t check_garbage(enum dcmp_carrier carrier, struct dcmp_device *device, uint32_t bytes, uint32_t seed,
                       const char *alphabet, uint32_t letters);

/* Own, arm, and run at `voltage_mV` until `drives` have been sent in RUN, one per period, `phase_us` after the tick.
 * Returns the time of the last DRIVE. */
uint32_t check_drive(struct dcmp_device *device, const struct dcmp_config *config, uint32_t start_us,
                     uint32_t phase_us, uint8_t ttl_ms, int16_t voltage_mV, uint32_t drives);

/* After check_drive: ticks go on, DRIVEs do not. Returns how long after the last DRIVE the voltage was 0, in us. */
uint32_t check_silence(struct dcmp_device *device, uint32_t period_us, uint32_t last_us, uint32_t phase_us,
                       uint32_t most_us);

/* An encoder at a steady speed shows one wrong count, too high and too low, of each size from `least` to `most`. Returns of
 * how many of those the limits, or the position after them, take notice. */
uint32_t check_wrong_counts(int32_t speed_limit, int32_t period_us, int32_t speed, uint32_t least, uint32_t most);

#endif
