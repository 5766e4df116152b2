/* The device: frames, time and counts in; frames, a voltage and ENABLE out. docs/protocol.md says what it does.
 *
 * Time is a free-running 32-bit microsecond counter that wraps; from call to call it must not step back, for that looks
 * like a host that was silent for an hour. Counts are the encoder's, modulo 2^24 or wider.
 * Nothing here waits, allocates, or keeps anything outside the structure it is handed. */
#ifndef DCMP_DEVICE_H
#define DCMP_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_frame.h"
#include "dcmp_message.h"

/* What the board was built with. Limits can be lowered over the wire, never raised. */
struct dcmp_config {
    int32_t board;
    int32_t boot_count;
    int32_t reset_cause;
    int32_t counts_per_rev;
    int32_t period_us;             /* 50..100000 */
    int32_t voltage_limit_mV;      /* 1..32767 */
    int32_t slew_mV_per_ms;        /* 0: no limit */
    int32_t watchdog_ms;           /* 5..50 */
    int32_t speed_limit_counts_s;  /* 1.. */
    int32_t travel_limit_counts;   /* 1.. */
    int32_t last_fault;            /* before this boot, as in FAULT; 0 for none that is known */
    int32_t last_fault_detail;
    int32_t supply_mV;             /* 0..: the motor's supply, where the amplifier divides it; 0 where it does not */
    uint16_t firmware_version;     /* major * 256 + minor */
    uint8_t node;                  /* 0..15 */
    bool edge_stamps;              /* the board can time-stamp edges */
};

/* What the amplifier has to do now. */
struct dcmp_output {
    int16_t voltage_mV;
    bool enable;
};

/* The newest edge of the encoder, where the board can time-stamp it. */
struct dcmp_edge {
    uint32_t counts;
    uint16_t age_us;
    int8_t direction;
    bool seen; /* since the tick before */
};

struct dcmp_device; /* complete in dcmp_device_state.h, for those that allocate one */

/* False, and the device stays silent at 0 V, if the configuration is outside its ranges. */
bool dcmp_device_init(struct dcmp_device *device, const struct dcmp_config *config, uint32_t now_us);

/* Take a frame from the link. */
void dcmp_device_receive(struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us);

/* The link dropped something that was no frame (CRC, framing, length). */
void dcmp_device_corrupt(struct dcmp_device *device, uint32_t now_us);

/* The link dropped bytes or frames for want of room. */
void dcmp_device_overrun(struct dcmp_device *device);

/* The link went down (hang-up, bus-off) or came back. */
void dcmp_device_link(struct dcmp_device *device, bool up, uint32_t now_us);

/* The board itself has failed: FAULT with this code from every state but BOOT, like a STOP. */
void dcmp_device_fail(struct dcmp_device *device, enum dcmp_fault_code code, int32_t detail, uint32_t now_us);

/* One period: to be called with the count latched at its start. `edge` may be null. */
struct dcmp_output dcmp_device_tick(struct dcmp_device *device, uint32_t now_us, uint32_t counts,
                                    const struct dcmp_edge *edge);

/* What the amplifier has to do now; looks at the watchdog. For use between ticks, as often as one likes. */
struct dcmp_output dcmp_device_output(struct dcmp_device *device, uint32_t now_us);

/* Whether it is armed, and no DRIVE that was computed from the newest SAMPLE has been accepted. */
bool dcmp_device_waits(const struct dcmp_device *device);

/* The board's own measurements, for HEALTH: a tick that came late, and the idle share. */
void dcmp_device_late_tick(struct dcmp_device *device);
void dcmp_device_idle(struct dcmp_device *device, uint8_t percent);

/* The next frame to send, if there is one. */
bool dcmp_device_transmit(struct dcmp_device *device, struct dcmp_frame *frame);

#endif
