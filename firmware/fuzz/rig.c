#include "rig.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "codec.h"

#define ROOM 256u
#define BEHIND 8u /* bytes behind a buffer's room, that stay as they are */
#define UNTOUCHED 0xA5
#define CODEC_PART 16u /* of the frames, one in so many goes through the codec once more, which takes as long as a tick */

static void require(bool holds, const char *what)
{
    if (!holds) {
        (void)fprintf(stderr, "wrong: %s\n", what);
        abort();
    }
}

static void mark_end(uint8_t *out, size_t room)
{
    memset(&out[room], UNTOUCHED, BEHIND);
}

static void require_end(const uint8_t *out, size_t room)
{
    for (size_t i = room; i < room + BEHIND; i++) {
        require(out[i] == UNTOUCHED, "more is written than there is room for");
    }
}

static void require_nothing(const char *wrong)
{
    require(wrong == NULL, wrong);
}

void rig_require_codec(const struct dcmp_frame *frame)
{
    const bool asked = frame->data[frame->length - 1u] % CODEC_PART == 0u; /* the checksum is as good as a draw */
    require(!asked || codec_returns(frame), "a frame is another one after it was unpacked and packed");
}

static void same_output(struct rig *rig, struct dcmp_output output)
{
    const struct dcmp_output expected = model_output(&rig->model);
    require(output.voltage_mV == expected.voltage_mV && output.enable == expected.enable,
            "voltage or ENABLE are not the model's");
    require(dcmp_device_waits(&rig->device) == model_waits(&rig->model), "it waits, or does not, unlike the model");
    rig->ran = rig->ran || output.enable;
}

static void settle(struct rig *rig)
{
    const struct dcmp_output output = dcmp_device_output(&rig->device, rig->now_us);
    model_look(&rig->model);
    require_nothing(watch_output(&rig->watch, &rig->config, output, rig->now_us));
    same_output(rig, output);
}

void rig_start(struct rig *rig, const struct dcmp_config *config, uint32_t now_us)
{
    static const struct rig nothing;
    *rig = nothing;
    rig->config = *config;
    rig->now_us = now_us;
    model_start(&rig->model, config, now_us);
    require(dcmp_device_init(&rig->device, config, now_us) == rig->model.alive, "what it was built with is judged");
    rig_carrier(rig, CARRIER_CAN);
    settle(rig);
}

void rig_carrier(struct rig *rig, enum carrier carrier)
{
    static const struct wire_ear silence;
    rig->carrier = carrier;
    rig->ear = silence;
    rig->ear.slcan = carrier == CARRIER_SLCAN;
    dcmp_port_init(&rig->port, carrier == CARRIER_SLCAN ? DCMP_CARRIER_SLCAN : DCMP_CARRIER_COBS);
}

void rig_frame(struct rig *rig, const struct dcmp_frame *frame)
{
    uint8_t bytes[WIRE_BYTES_MAX];
    if (rig->carrier == CARRIER_CAN) {
        dcmp_device_receive(&rig->device, frame, rig->now_us);
        watch_frame(&rig->watch, &rig->config, frame, rig->now_us);
        model_frame(&rig->model, frame);
        settle(rig);
        return;
    }
    const size_t length = rig->ear.slcan ? wire_slcan(frame, bytes) : wire_cobs(frame, bytes);
    rig_bytes(rig, bytes, length, ROOM);
}

/* What the model's side of a byte port does with bytes; how many it answers. */
static size_t hear(struct rig *rig, const uint8_t *bytes, size_t length, uint8_t *out, size_t room)
{
    struct dcmp_frame frame;
    size_t replied = 0;
    for (size_t i = 0; i < length; i++) {
        const enum wire_heard heard = wire_hear(&rig->ear, bytes[i], &frame);
        if (heard == WIRE_FRAME) {
            watch_frame(&rig->watch, &rig->config, &frame, rig->now_us);
            model_frame(&rig->model, &frame);
        } else if (heard == WIRE_CORRUPT) {
            model_corrupt(&rig->model);
        }
        if (heard != WIRE_NOTHING && heard != WIRE_FRAME && rig->ear.replied <= room - replied) {
            memcpy(&out[replied], rig->ear.reply, rig->ear.replied);
            replied += rig->ear.replied;
        }
    }
    return replied;
}

void rig_bytes(struct rig *rig, const uint8_t *bytes, size_t length, size_t room)
{
    uint8_t out[ROOM + BEHIND];
    uint8_t expected[ROOM];
    mark_end(out, room);
    const size_t replied =
        dcmp_port_receive(&rig->port, &rig->device, bytes, length, rig->now_us, out, room);
    require(replied == hear(rig, bytes, length, expected, room), "as many bytes are answered as by the model");
    require_end(out, room);
    require(memcmp(out, expected, replied) == 0, "the answer to bytes is the model's");
    settle(rig);
}

void rig_corrupt(struct rig *rig)
{
    dcmp_device_corrupt(&rig->device, rig->now_us);
    model_corrupt(&rig->model);
    settle(rig);
}

void rig_tick(struct rig *rig, int32_t step, const struct dcmp_edge *edge)
{
    rig->now_us += (uint32_t)rig->config.period_us;
    rig->counts += (uint32_t)step;
    const struct dcmp_output output = dcmp_device_tick(&rig->device, rig->now_us, rig->counts, edge);
    rig->model.now_us = rig->now_us;
    model_tick(&rig->model, rig->counts, edge);
    require_nothing(watch_tick(&rig->watch, &rig->config, output, rig->now_us));
    same_output(rig, output);
    rig->ticks++;
    rig->ticks_with_frames += rig->model.given != rig->given_before ? 1u : 0u;
    rig->given_before = rig->model.given;
    if (!rig->blocked) {
        rig_read(rig, ROOM);
    }
}

void rig_time(struct rig *rig, uint32_t us)
{
    rig->now_us += us;
    rig->model.now_us = rig->now_us;
    settle(rig);
}

void rig_link(struct rig *rig, bool up)
{
    dcmp_device_link(&rig->device, up, rig->now_us);
    model_link(&rig->model, up);
    rig->watch.link_down = !up;
    if (!up) {
        watch_forbid(&rig->watch);
    }
    settle(rig);
}

void rig_fail(struct rig *rig, uint32_t code, int32_t detail)
{
    dcmp_device_fail(&rig->device, (enum dcmp_fault_code)code, detail, rig->now_us);
    model_fail(&rig->model, code, detail);
    watch_forbid(&rig->watch);
    settle(rig);
}

void rig_late(struct rig *rig)
{
    dcmp_device_late_tick(&rig->device);
    model_count(&rig->model, LATE_TICKS);
}

void rig_overrun(struct rig *rig)
{
    dcmp_device_overrun(&rig->device);
    model_count(&rig->model, RING_OVERRUNS);
}

void rig_idle(struct rig *rig, uint8_t percent)
{
    dcmp_device_idle(&rig->device, percent);
    rig->model.counters[IDLE_PERCENT] = percent > 100u ? 100u : percent;
}

static void read_frames(struct rig *rig)
{
    struct dcmp_frame got;
    struct dcmp_frame expected;
    bool more = true;
    while (more) {
        more = dcmp_device_transmit(&rig->device, &got);
        require(more == model_transmit(&rig->model, &expected), "as many frames are sent as by the model");
        require(!more || (got.id == expected.id && got.length == expected.length &&
                          memcmp(got.data, expected.data, got.length) == 0), "a frame is the model's");
        if (more) {
            rig_require_codec(&got);
        }
    }
}

void rig_read(struct rig *rig, size_t room)
{
    uint8_t out[ROOM + BEHIND];
    uint8_t expected[ROOM];
    struct dcmp_frame frame;
    if (rig->carrier == CARRIER_CAN) {
        read_frames(rig);
        return;
    }
    const size_t longest = rig->ear.slcan ? 22u : 14u; /* of a frame that a device sends */
    mark_end(out, room);
    const size_t sent = dcmp_port_transmit(&rig->port, &rig->device, out, room);
    require_end(out, room);
    size_t length = 0;
    while (room - length >= longest && model_transmit(&rig->model, &frame)) {
        if (!rig->ear.slcan) {
            length += wire_cobs(&frame, &expected[length]);
        } else if (!rig->ear.closed) {
            length += wire_slcan(&frame, &expected[length]);
        }
    }
    require(sent == length && memcmp(out, expected, sent) == 0, "the bytes that are sent are the model's");
}
