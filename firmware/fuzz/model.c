#include "model.h"

#include <string.h>

#include "dcmp_protocol_hash.h"
#include "model_inside.h"
#include "wire.h"

#define LEASE_US 500000u

static const struct model nothing;

void model_count(struct model *model, enum model_counter counter)
{
    if (model->counters[counter] != 255u) {
        model->counters[counter]++;
    }
}

uint32_t model_whole_ticks(const struct model *model, uint32_t us)
{
    const uint32_t period_us = (uint32_t)model->value[DCMP_PERIOD_US];
    return us / period_us + (us % period_us != 0u ? 1u : 0u);
}

bool model_is_live(const struct model *model)
{
    return model->state == MODEL_ARMING || model->state == MODEL_RUN;
}

void model_start(struct model *model, const struct dcmp_config *config, uint32_t now_us)
{
    *model = nothing;
    model->now_us = now_us;
    model->alive = model_is_sound(config);
    if (!model->alive) {
        return;
    }
    const int32_t built[MODEL_PARAMETERS] = {
        0, config->board, config->boot_count, config->reset_cause, 0, config->counts_per_rev, config->period_us,
        config->voltage_limit_mV, config->slew_mV_per_ms, config->watchdog_ms, config->speed_limit_counts_s,
        config->travel_limit_counts, 0, config->last_fault, config->last_fault_detail, config->supply_mV, -1};
    memcpy(model->built, built, sizeof built);
    memcpy(model->value, built, sizeof built);
    model->node = config->node;
    model->version = config->firmware_version;
    model->edges = config->edge_stamps;
    model->link_up = true;
    model->first_of_session = true;
    model->health_due = model_whole_ticks(model, 100000u);
}

/* ------------------------------------------------------------------------------------------ states */

static void enter(struct model *model, enum model_state state)
{
    model->state = state;
    if (state != MODEL_RUN) {
        model->command_mV = 0;
        model->voltage_uV = 0;
        model->limited = false;
    } else {
        motion_arm(&model->motion);
    }
    if (state != MODEL_ARMING) {
        model->arming = 0;
    }
    if (state != MODEL_FAULT) {
        model->code = 0;
        model->detail = 0;
        model->fault_tick = 0;
        model->lowered = false;
    }
}

static void fault(struct model *model, uint32_t code, int32_t detail)
{
    enter(model, MODEL_FAULT);
    model->code = code;
    model->detail = detail;
    model->fault_tick = (model->ticks - 1u) & 0xFFu;
    model->fault_due = 0;
}

void model_fault_from_run(struct model *model, uint32_t code, int32_t detail)
{
    if (model->state == MODEL_RUN) {
        fault(model, code, detail);
    }
}

static void stop(struct model *model, uint32_t code, int32_t detail)
{
    if (model->state != MODEL_BOOT && model->state != MODEL_FAULT) {
        fault(model, code, detail);
    }
}

/* What a session has set ends with it. */
static void end_session(struct model *model)
{
    const int32_t tick = model->value[DCMP_TICK];
    memcpy(model->value, model->built, sizeof model->value);
    model->value[DCMP_TICK] = tick;
    model->owner = 0;
    model->first_of_session = true;
    model->seq = 0;
}

void model_look(struct model *model)
{
    if (!model->alive) {
        return;
    }
    const uint32_t silent_us = model->now_us - model->fed_us;
    if (model_is_live(model) && silent_us > model->patience_us) {
        model_fault_from_run(model, 1, (int32_t)(silent_us & 0x7FFFFFFFu));
        if (model->state == MODEL_ARMING) {
            enter(model, MODEL_IDLE);
        }
    }
    if (!model->link_up) {
        model_fault_from_run(model, 2, 0);
        if (model->state == MODEL_ARMING) {
            enter(model, MODEL_IDLE);
        }
    }
    if (!model_is_live(model) && model->owner != 0u && model->now_us - model->heard_us >= LEASE_US) {
        end_session(model);
    }
}

void model_link(struct model *model, bool up)
{
    if (model->alive && model->link_up && !up) {
        model_count(model, BUS_OFFS);
        model->answers_waiting = 0;
    }
    model->link_up = up;
    model_look(model);
}

void model_fail(struct model *model, uint32_t code, int32_t detail)
{
    model_look(model);
    stop(model, code, detail);
}

/* ------------------------------------------------------------------------------------------ frames */

static void add_frame(struct model *model, bool corrupt)
{
    const bool oldest = model->corrupt[model->frame];
    model->corrupt[model->frame] = corrupt;
    model->frame = (model->frame + 1u) % MODEL_FRAMES;
    model->bad_frames = model->bad_frames + (corrupt ? 1u : 0u) - (oldest ? 1u : 0u);
    model->given++;
}

void model_corrupt(struct model *model)
{
    if (!model->alive) {
        return;
    }
    model_look(model);
    add_frame(model, true);
    model_count(model, CRC_ERRORS);
    if (model->bad_frames >= 10u) {
        model_fault_from_run(model, 4, (int32_t)model->bad_frames);
    }
}

static void say(struct model *model, enum wire_number number, uint32_t id, uint32_t last)
{
    if (model->answers_waiting == MODEL_ANSWERS) {
        model_count(model, RING_OVERRUNS);
        return;
    }
    const struct model_answer answer = {(uint8_t)number, (uint8_t)id, (uint8_t)last};
    model->answers[(model->answer + model->answers_waiting++) % MODEL_ANSWERS] = answer;
}

static void hello(struct model *model, uint32_t session, bool same_hash)
{
    if (same_hash && session != 0u && model->owner == 0u) {
        model->owner = session;
        model->lowered = false;
        model->heard_us = model->now_us;
    } else if (same_hash && session != 0u && model->owner == session) {
        model->heard_us = model->now_us;
    }
    const uint32_t owned = session != 0u && model->owner == session ? 1u : 0u;
    const uint32_t busy = model->owner != 0u && owned == 0u ? 1u : 0u;
    say(model, WIRE_IDENTITY, 0, busy + 2u * owned + (same_hash ? 0u : 4u));
}

static void set(struct model *model, const struct dcmp_frame *frame)
{
    const uint32_t session = wire_get(frame, 0, 2);
    const bool owner = session != 0u && session == model->owner;
    const uint32_t id = frame->data[2];
    if (owner) {
        model->heard_us = model->now_us;
    }
    say(model, WIRE_VALUE, id, model_set_parameter(model, id, (int32_t)wire_get(frame, 3, 4), owner));
}

/* An accepted DRIVE, by state. */
static void obey(struct model *model, uint32_t flags, int32_t voltage_mV, bool close)
{
    const bool arm = (flags & 1u) != 0u;
    const bool clear = (flags & 2u) != 0u;
    switch (model->state) {
    case MODEL_IDLE:
        enter(model, arm && voltage_mV == 0 ? MODEL_ARMING : MODEL_IDLE);
        model->arming = model->state == MODEL_ARMING ? 1u : 0u;
        break;
    case MODEL_ARMING:
        if (!arm || voltage_mV != 0 || !close) {
            enter(model, MODEL_IDLE);
        } else if (++model->arming == 10u) {
            enter(model, MODEL_RUN);
        }
        break;
    case MODEL_RUN:
        if (arm) {
            model->command_mV = voltage_mV;
        } else {
            enter(model, MODEL_IDLE);
        }
        break;
    case MODEL_FAULT:
        if (clear && voltage_mV == 0 && model->lowered) {
            enter(model, MODEL_IDLE);
        } else if (!clear) {
            model->lowered = true;
        }
        break;
    default:
        break;
    }
}

static void drive(struct model *model, const struct dcmp_frame *frame)
{
    const uint32_t flags = frame->data[2] & 7u;
    const uint32_t seq = wire_get(frame, 2, 2) >> 3;
    const uint32_t ttl_ms = frame->data[6];
    const uint32_t age = (model->ticks - 1u - seq) % 8192u;
    const uint32_t step = (seq - model->seq) % 8192u;
    const uint32_t oldest = model_whole_ticks(model, 3000u);
    if (model->state == MODEL_BOOT || model->owner == 0u || wire_get(frame, 4, 2) != model->owner) {
        return;
    }
    if (ttl_ms < 5u || ttl_ms > 50u || (flags & (flags - 1u)) != 0u) {
        return;
    }
    if (age > oldest || (!model->first_of_session && (step < 1u || step > 4095u))) {
        model_count(model, SEQUENCE_GAPS);
        return;
    }
    const uint32_t watchdog_us = 1000u * (uint32_t)model->value[DCMP_WATCHDOG_MS];
    model->first_of_session = false;
    model->seq = seq;
    model->driven = true;
    model->heard_us = model->now_us;
    model->fed_us = model->now_us;
    model->patience_us = 1000u * ttl_ms < watchdog_us ? 1000u * ttl_ms : watchdog_us;
    obey(model, flags, (int16_t)wire_get(frame, 0, 2), step <= oldest);
    if ((flags & 4u) != 0u) {
        end_session(model);
    }
}

void model_frame(struct model *model, const struct dcmp_frame *frame)
{
    const uint32_t number = frame->id / 16u;
    const uint8_t length = wire_length_from_host(number);
    if (!model->alive || frame->id % 16u != model->node || length == 0u || frame->length != length) {
        return; /* not for this device */
    }
    if (frame->data[length - 1u] != wire_crc8(frame)) {
        model_corrupt(model);
        return;
    }
    model_look(model);
    add_frame(model, false);
    switch (number) {
    case WIRE_STOP:
        stop(model, 3, frame->data[0]);
        break;
    case WIRE_DRIVE:
        drive(model, frame);
        break;
    case WIRE_HELLO:
        hello(model, wire_get(frame, 0, 2), wire_get(frame, 2, 4) == DCMP_PROTOCOL_HASH);
        break;
    case WIRE_GET:
        say(model, WIRE_VALUE, frame->data[0], frame->data[0] >= 1u && frame->data[0] < MODEL_PARAMETERS ? 0u : 1u);
        break;
    default:
        set(model, frame);
        break;
    }
}

void model_judge_tick(struct model *model, uint32_t counts, bool missed)
{
    const int32_t *value = model->value;
    motion_tick(&model->motion, counts, model->built[DCMP_SPEED_LIMIT_COUNTS_S], value[DCMP_PERIOD_US]);
    if (model->state == MODEL_BOOT) {
        enter(model, MODEL_IDLE);
    }
    if (missed && model_is_live(model)) {
        model_count(model, SEQUENCE_GAPS);
    }
    const struct motion_limits limits = {
        .period_us = value[DCMP_PERIOD_US],
        .speed = value[DCMP_SPEED_LIMIT_COUNTS_S],
        .built_speed = model->built[DCMP_SPEED_LIMIT_COUNTS_S],
        .travel = value[DCMP_TRAVEL_LIMIT_COUNTS],
        .built_travel = model->built[DCMP_TRAVEL_LIMIT_COUNTS],
        .origin = value[DCMP_TRAVEL_ORIGIN_COUNTS],
    };
    const struct motion_fault found = motion_judge(&model->motion, &limits);
    if (found.code != 0u) {
        model_fault_from_run(model, found.code, found.detail);
    }
    model_look(model);
}

struct dcmp_output model_output(const struct model *model)
{
    const struct dcmp_output output = {(int16_t)(model->voltage_uV / 1000), model->state == MODEL_RUN};
    return output;
}

bool model_waits(const struct model *model)
{
    return model_is_live(model) && model->seq != (model->ticks - 1u) % 8192u;
}
