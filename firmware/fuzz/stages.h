/* Where an execution starts: boards of several kinds, in several states, reached by what a host does and then copied. */
#ifndef FUZZ_STAGES_H
#define FUZZ_STAGES_H

#include "rig.h"

#define BOARDS 8u
#define STAGES 8u
#define SESSION 0x1234u

enum stage { STAGE_BOOT, STAGE_OWNED, STAGE_ARMING, STAGE_RUN, STAGE_WORN, STAGE_FAULT, STAGE_LOWERED, STAGE_WRAP };

const struct dcmp_config *stages_board(uint32_t board);
const struct rig *stages_get(uint32_t board, uint32_t stage);

/* Frames of a host. */
void host_drive(struct rig *rig, uint32_t session, int32_t voltage_mV, uint32_t flags, uint32_t behind, uint32_t ttl_ms);
void host_hello(struct rig *rig, uint32_t session, uint32_t hash);
void host_set(struct rig *rig, uint32_t session, uint32_t id, int32_t value);
void host_get(struct rig *rig, uint32_t id);
void host_stop(struct rig *rig, uint32_t reason);

#endif
