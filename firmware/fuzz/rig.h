/* The core and its model side by side: what is done is done to both, and what comes out is compared. */
#ifndef FUZZ_RIG_H
#define FUZZ_RIG_H

#include "dcmp_device_state.h"
#include "dcmp_port.h"
#include "model.h"
#include "watch.h"
#include "wire.h"

enum carrier { CARRIER_CAN, CARRIER_COBS, CARRIER_SLCAN, CARRIERS };

struct rig {
    struct dcmp_config config;
    struct dcmp_device device;
    struct dcmp_port port;
    struct wire_ear ear;
    struct model model;
    struct watch watch;
    enum carrier carrier;
    uint32_t now_us;
    uint32_t counts;
    bool blocked; /* the host does not read */
    uint32_t given_before; /* frames, at the tick before */
    /* for statistics */
    uint32_t ticks;
    uint32_t ticks_with_frames;
    bool ran;
};

void rig_start(struct rig *rig, const struct dcmp_config *config, uint32_t now_us);
void rig_carrier(struct rig *rig, enum carrier carrier);
void rig_frame(struct rig *rig, const struct dcmp_frame *frame);
void rig_bytes(struct rig *rig, const uint8_t *bytes, size_t length, size_t room);
void rig_corrupt(struct rig *rig);
void rig_tick(struct rig *rig, int32_t step, const struct dcmp_edge *edge);
void rig_time(struct rig *rig, uint32_t us);
void rig_link(struct rig *rig, bool up);
void rig_fail(struct rig *rig, uint32_t code, int32_t detail);
void rig_late(struct rig *rig);
void rig_overrun(struct rig *rig);
void rig_idle(struct rig *rig, uint8_t percent);

/* A frame that is whole is itself after the core has unpacked and packed it. */
void rig_require_codec(const struct dcmp_frame *frame);

/* Read what the device says, as much as there is room for. */
void rig_read(struct rig *rig, size_t room);

#endif
