#include "stages.h"

#include "dcmp_protocol_hash.h"

#define MOST INT32_MAX

/* Usual and extreme ones. Every period but the longest is shorter than the watchdog's time. */
static const struct dcmp_config boards[BOARDS] = {
    {2, 7, 1, 4096, 1000, 10000, 0, 20, 40000, 200, 0, 0, 0, 0x0102, 0, true},
    {2, 8, 4, 8192, 1000, 12000, 100, 25, 20000, 90, 3, 2, 24000, 0x0102, 3, true},
    {3, 0, 2, 4096, 250, 10000, 0, 20, 60000, 100, 0, 0, 0, 0x0001, 0, true},
    {5, 1, 3, 4096, 100, 24000, 150, 10, 200000, 50000, 0, 0, 24000, 0xFFFF, 15, false},
    {2, 2, 5, 1000, 10000, 5000, 7, 50, 1000, 60, 9, 64, 0, 0x0102, 1, true},
    {2, 3, 0, MOST, 1000, 32767, MOST, 50, MOST, MOST, 0, 0, MOST, 0x0102, 0, true},
    {2, 4, 0, 1, 50, 1, 1, 5, MOST, 100000000, 0, 0, 0, 0x0102, 2, false},
    {2, 5, 0, 4096, 100000, 10000, 0, 50, 500, 500, 0, 0, 0, 0x0102, 0, true},
};
static const uint32_t starts_us[BOARDS] = {0u, 0xFFFF8000u, 5u, 0u, 0xFFFFFFFFu, 0x7FFFFF00u, 0u, 0u};

const struct dcmp_config *stages_board(uint32_t board)
{
    return &boards[board];
}

static void send(struct rig *rig, struct dcmp_frame *frame)
{
    wire_seal(frame);
    rig_require_codec(frame);
    rig_frame(rig, frame);
}

void host_drive(struct rig *rig, uint32_t session, int32_t voltage_mV, uint32_t flags, uint32_t behind, uint32_t ttl_ms)
{
    struct dcmp_frame frame = wire_begin(WIRE_DRIVE, rig->config.node);
    wire_put(&frame, (uint32_t)voltage_mV, 2);
    wire_put(&frame, flags + 8u * ((rig->model.ticks - 1u - behind) % 8192u), 2);
    wire_put(&frame, session, 2);
    wire_put(&frame, ttl_ms, 1);
    send(rig, &frame);
}

void host_hello(struct rig *rig, uint32_t session, uint32_t hash)
{
    struct dcmp_frame frame = wire_begin(WIRE_HELLO, rig->config.node);
    wire_put(&frame, session, 2);
    wire_put(&frame, hash, 4);
    send(rig, &frame);
}

void host_set(struct rig *rig, uint32_t session, uint32_t id, int32_t value)
{
    struct dcmp_frame frame = wire_begin(WIRE_SET, rig->config.node);
    wire_put(&frame, session, 2);
    wire_put(&frame, id, 1);
    wire_put(&frame, (uint32_t)value, 4);
    send(rig, &frame);
}

void host_get(struct rig *rig, uint32_t id)
{
    struct dcmp_frame frame = wire_begin(WIRE_GET, rig->config.node);
    wire_put(&frame, id, 1);
    send(rig, &frame);
}

void host_stop(struct rig *rig, uint32_t reason)
{
    struct dcmp_frame frame = wire_begin(WIRE_STOP, rig->config.node);
    wire_put(&frame, reason, 1);
    send(rig, &frame);
}

static void arm(struct rig *rig, uint32_t times)
{
    for (uint32_t i = 0; i < times; i++) {
        host_drive(rig, SESSION, 0, 1u, 0u, 50u);
        rig_tick(rig, 0, NULL);
    }
}

/* Counters and histories one short of what ends something. */
static void wear(struct rig *rig)
{
    for (uint32_t i = 0; i < 254u; i++) {
        rig_corrupt(rig);
        rig_late(rig);
        rig_overrun(rig);
        rig_link(rig, false);
        rig_link(rig, true);
    }
    host_hello(rig, SESSION, DCMP_PROTOCOL_HASH);
    for (uint32_t i = 0; i < 254u; i++) {
        host_drive(rig, SESSION, 0, 0u, 4000u, 20u); /* a good frame, and a gap in the sequence */
    }
    for (uint32_t i = 0; i < 9u; i++) {
        rig_corrupt(rig);
    }
    rig_tick(rig, 0x400000, NULL);
    rig_tick(rig, -0x400000, NULL);
    rig_tick(rig, 0, NULL);
}

static void reach(struct rig *rig, uint32_t stage)
{
    if (stage == (uint32_t)STAGE_BOOT) {
        return;
    }
    for (uint32_t i = 0; i < (stage == (uint32_t)STAGE_WRAP ? 8188u : 1u); i++) {
        rig_tick(rig, 0, NULL);
    }
    if (stage == (uint32_t)STAGE_WORN) {
        wear(rig);
    }
    host_hello(rig, SESSION, DCMP_PROTOCOL_HASH);
    if (stage == (uint32_t)STAGE_LOWERED) {
        const int32_t few_counts_s = 1000;
        host_set(rig, SESSION, DCMP_VOLTAGE_LIMIT_MV, 600);
        host_set(rig, SESSION, DCMP_SLEW_MV_PER_MS, 50);
        host_set(rig, SESSION, DCMP_WATCHDOG_MS, 8);
        host_set(rig, SESSION, DCMP_SPEED_LIMIT_COUNTS_S, few_counts_s);
        host_set(rig, SESSION, DCMP_TRAVEL_LIMIT_COUNTS, 20);
        host_set(rig, SESSION, DCMP_TRAVEL_ORIGIN_COUNTS, 0xFFFFFF);
        host_set(rig, SESSION, DCMP_EDGE_STAMPS, 1);
    }
    if (stage >= (uint32_t)STAGE_ARMING) {
        arm(rig, stage == (uint32_t)STAGE_ARMING ? 9u : 12u);
    }
    if (stage == (uint32_t)STAGE_WORN) {
        arm(rig, 66u); /* the corrupt frames are about to leave the last 100 */
    }
    if (stage == (uint32_t)STAGE_FAULT) {
        host_stop(rig, 3);
        rig_tick(rig, 0, NULL);
        host_drive(rig, SESSION, 0, 0u, 0u, 20u);
        rig_tick(rig, 0, NULL);
    }
}

const struct rig *stages_get(uint32_t board, uint32_t stage)
{
    static struct rig made[BOARDS][STAGES];
    static bool done[BOARDS][STAGES];
    struct rig *rig = &made[board][stage];
    if (!done[board][stage]) {
        rig_start(rig, &boards[board], starts_us[board]);
        reach(rig, stage);
        rig->ticks = 0;
        rig->ticks_with_frames = 0;
        rig->ran = false;
        rig->given_before = rig->model.given;
        done[board][stage] = true;
    }
    return rig;
}
