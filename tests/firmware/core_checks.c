#include "core_checks.h"

#define SESSION 0x1234u

uint32_t check_protocol_hash(void)
{
    return DCMP_PROTOCOL_HASH;
}

uint32_t check_device_size(void)
{
    return (uint32_t)sizeof(struct dcmp_device);
}

static bool same(const struct dcmp_frame *a, const struct dcmp_frame *b)
{
    bool equal = a->id == b->id && a->length == b->length;
    for (uint32_t i = 0; equal && i < a->length; i++) {
        equal = a->data[i] == b->data[i];
    }
    return equal;
}

static size_t encode(enum dcmp_carrier carrier, const struct dcmp_frame *frame, uint8_t *bytes)
{
    return carrier == DCMP_CARRIER_COBS ? dcmp_cobs_send(frame, bytes) : dcmp_slcan_send(frame, bytes);
}

static bool accepted(const struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us)
{
    struct dcmp_device copy = *device;
    copy.driven = false;
    dcmp_device_receive(&copy, frame, now_us);
    return copy.driven;
}

/* The damaged frame and two good ones. */
static void judge(enum dcmp_carrier carrier, const struct dcmp_device *device, const uint8_t *damaged, size_t length,
                  const struct dcmp_frame *frame, const struct dcmp_frame *marker, struct flips *flips)
{
    struct dcmp_port port;
    struct dcmp_frame got;
    uint8_t bytes[3 * DCMP_SLCAN_ENCODED_MAX];
    size_t total = length;
    uint32_t markers = 0;
    for (size_t i = 0; i < length; i++) {
        bytes[i] = damaged[i];
    }
    total += encode(carrier, marker, &bytes[total]);
    total += encode(carrier, marker, &bytes[total]);
    dcmp_port_init(&port, carrier);
    flips->tried++;
    for (size_t i = 0; i < total; i++) {
        const enum dcmp_received received = carrier == DCMP_CARRIER_COBS
                                                ? dcmp_cobs_receive(&port.cobs, bytes[i], &got)
                                                : dcmp_slcan_receive(&port.slcan, bytes[i], &got);
        if (received != DCMP_FRAME) {
            continue;
        }
        if (same(&got, marker)) {
            markers++;
        } else if (!same(&got, frame) && dcmp_check_any(&got, device->node) == DCMP_GENUINE) {
            flips->passed++;
            flips->drives += accepted(device, &got, device->watchdog.fed_us + 1u) ? 1u : 0u;
        } else if (same(&got, frame)) {
            flips->passed++; /* damaged and yet the same: nothing that should happen either */
        }
    }
    flips->lost += markers == 0u || markers > 2u ? 1u : 0u;
}

struct flips check_stream_flips(enum dcmp_carrier carrier, const struct dcmp_device *device,
                                const struct dcmp_frame *frame, const struct dcmp_frame *marker, bool two)
{
    struct flips flips = {0, 0, 0, 0};
    uint8_t bytes[DCMP_SLCAN_ENCODED_MAX];
    const size_t length = encode(carrier, frame, bytes);
    for (size_t i = 0; i < 8u * length; i++) {
        bytes[i / 8u] = (uint8_t)(bytes[i / 8u] ^ (1u << (i % 8u)));
        if (!two) {
            judge(carrier, device, bytes, length, frame, marker, &flips);
        }
        for (size_t j = i + 1u; two && j < 8u * length; j++) {
            bytes[j / 8u] = (uint8_t)(bytes[j / 8u] ^ (1u << (j % 8u)));
            judge(carrier, device, bytes, length, frame, marker, &flips);
            bytes[j / 8u] = (uint8_t)(bytes[j / 8u] ^ (1u << (j % 8u)));
        }
        bytes[i / 8u] = (uint8_t)(bytes[i / 8u] ^ (1u << (i % 8u)));
    }
    return flips;
}

static void flip(struct dcmp_frame *frame, uint32_t bit)
{
    if (bit < 11u) {
        frame->id = (uint16_t)(frame->id ^ (1u << bit));
    } else {
        uint8_t *byte = &frame->data[(bit - 11u) / 8u];
        *byte = (uint8_t)(*byte ^ (1u << ((bit - 11u) % 8u)));
    }
}

/* Any node's device: a flip may change the node too. */
static void judge_can(const struct dcmp_frame *frame, struct flips *flips)
{
    flips->tried++;
    flips->passed += dcmp_check_any(frame, (uint8_t)(frame->id & 0xFu)) == DCMP_GENUINE ? 1u : 0u;
}

struct flips check_can_flips(const struct dcmp_frame *frame, bool two)
{
    struct flips flips = {0, 0, 0, 0};
    struct dcmp_frame damaged = *frame;
    const uint32_t bits = 11u + 8u * frame->length;
    for (uint32_t i = 0; i < bits; i++) {
        flip(&damaged, i);
        if (!two) {
            judge_can(&damaged, &flips);
        }
        for (uint32_t j = i + 1u; two && j < bits; j++) {
            flip(&damaged, j);
            judge_can(&damaged, &flips);
            flip(&damaged, j);
        }
        flip(&damaged, i);
    }
    return flips;
}

static uint32_t chance(uint32_t *seed)
{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 17;
    *seed ^= *seed << 5;
    return *seed;
}

uint32_t check_garbage(enum dcmp_carrier carrier, struct dcmp_device *device, uint32_t bytes, uint32_t seed,
                       const char *alphabet, uint32_t letters)
{
    struct dcmp_port port;
    uint8_t out[64];
    uint32_t bad = 0;
    uint32_t now_us = 0;
    dcmp_port_init(&port, carrier);
    for (uint32_t i = 0; i < bytes; i++) {
        const uint32_t drawn = chance(&seed);
        const uint8_t byte = letters == 0u ? (uint8_t)(drawn >> 8) : (uint8_t)alphabet[(drawn >> 8) % letters];
        (void)dcmp_port_receive(&port, device, &byte, 1, now_us, out, sizeof out);
        bad += device->driven ? 1u : 0u;
        if (i % 64u == 0u) {
            now_us += 1000u;
            const struct dcmp_output output = dcmp_device_tick(device, now_us, drawn, 0);
            bad += output.enable || output.voltage_mV != 0 || device->supervisor.state != DCMP_IDLE ? 1u : 0u;
            (void)dcmp_port_transmit(&port, device, out, sizeof out);
        }
    }
    return bad;
}

static void say_hello(struct dcmp_device *device, uint32_t now_us)
{
    struct dcmp_frame frame;
    const struct dcmp_hello hello = {SESSION, DCMP_PROTOCOL_HASH};
    dcmp_pack_hello(&frame, device->node, &hello);
    dcmp_device_receive(device, &frame, now_us);
}

uint32_t check_drive(struct dcmp_device *device, const struct dcmp_config *config, uint32_t start_us,
                     uint32_t phase_us, uint8_t ttl_ms, int16_t voltage_mV, uint32_t drives)
{
    const uint32_t period_us = (uint32_t)config->period_us;
    uint32_t now_us = start_us;
    (void)dcmp_device_init(device, config, start_us);
    say_hello(device, start_us);
    for (uint32_t i = 0; i < DCMP_ARMING_DRIVES + drives; i++) {
        struct dcmp_frame frame;
        const struct dcmp_drive drive = {.voltage_mV = i < DCMP_ARMING_DRIVES ? (int16_t)0 : voltage_mV,
                                         .seq = (uint16_t)(i & DCMP_SEQ_MASK),
                                         .arm = true,
                                         .session = SESSION,
                                         .ttl_ms = ttl_ms};
        now_us = start_us + i * period_us;
        (void)dcmp_device_tick(device, now_us, 0, 0);
        now_us += phase_us;
        dcmp_pack_drive(&frame, device->node, &drive);
        dcmp_device_receive(device, &frame, now_us);
    }
    return now_us;
}

uint32_t check_silence(struct dcmp_device *device, uint32_t period_us, uint32_t last_us, uint32_t phase_us,
                       uint32_t most_us)
{
    uint32_t now_us = last_us - phase_us;
    bool driven = false;
    while (now_us + period_us - last_us <= most_us) {
        now_us += period_us;
        const struct dcmp_output output = dcmp_device_tick(device, now_us, 0, 0);
        driven = driven || output.voltage_mV != 0;
        if (driven && output.voltage_mV == 0 && !output.enable) {
            return now_us - last_us;
        }
    }
    return UINT32_MAX;
}

#define FIRST_SIZES 4096
#define TURNED 200 /* periods before the wrong count: more than are looked back at */

/* True count some periods after the wrong one; the counter wraps on the way there. */
static int64_t turned(int32_t speed, int32_t period_us, int32_t after)
{
    return (int64_t)speed * period_us * (TURNED + after) / 1000000;
}

static uint32_t shown(int64_t count)
{
    return (uint32_t)(count - 5); /* wraps while it turns */
}

/* The longest window and the three counts of a middle reach no further back than that. Beyond it a wrong count shows
 * only by an error that reads another place of the ring: the first sizes, and one in 64, are followed that far. */
static int32_t periods_after(const struct dcmp_encoder *encoder, int64_t wrong)
{
    const int64_t size = wrong < 0 ? -wrong : wrong;
    const bool all = size < FIRST_SIZES || size % 64 == 0;
    return all ? (int32_t)DCMP_POSITIONS : encoder->windows[DCMP_WINDOWS - 1u].periods + 4;
}

static bool noticed(struct dcmp_encoder encoder, int32_t speed_limit, int32_t period_us, int32_t speed, int64_t wrong)
{
    bool bad = false;
    const struct dcmp_speed_limits limits = {speed_limit, speed_limit};
    const int32_t periods = periods_after(&encoder, wrong);
    for (int32_t after = 0; after < periods && !bad; after++) {
        const int64_t count = turned(speed, period_us, after);
        const int64_t travel = count < 0 ? -count : count;
        dcmp_encoder_tick(&encoder, shown(after == 0 ? count + wrong : count), speed_limit, period_us);
        bad = dcmp_encoder_too_fast(&encoder, &limits) || dcmp_encoder_too_jumpy(&encoder) ||
              dcmp_encoder_too_far(&encoder, (int32_t)travel) || (after > 0 && encoder.position != count);
    }
    return bad;
}

uint32_t check_wrong_counts(int32_t speed_limit, int32_t period_us, int32_t speed, uint32_t least, uint32_t most)
{
    struct dcmp_encoder encoder;
    uint32_t bad = 0;
    dcmp_encoder_init(&encoder, period_us);
    dcmp_encoder_anchor(&encoder);
    for (int32_t after = -TURNED; after < 0; after++) {
        dcmp_encoder_tick(&encoder, shown(turned(speed, period_us, after)), speed_limit, period_us);
    }
    for (uint32_t size = least; size <= most; size++) {
        bad += noticed(encoder, speed_limit, period_us, speed, (int64_t)size) ? 1u : 0u;
        bad += noticed(encoder, speed_limit, period_us, speed, -(int64_t)size) ? 1u : 0u;
    }
    return bad;
}
