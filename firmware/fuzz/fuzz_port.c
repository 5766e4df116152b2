/* A port of either carrier with a device behind it, under arbitrary bytes and times. Aborts if the device puts anything
 * out that it must not: ENABLE or a voltage outside RUN, more than its limit, RUN without a right HELLO or with a silent
 * host.
 *
 * The first byte chooses carrier, node and the timer's start. The rest is a program: pieces of up to 31 bytes for the
 * port, with what happens behind each in the byte before it. */
#include "fuzz_port.h"

#include <stdlib.h>

#include "dcmp_device_state.h"
#include "dcmp_port.h"
#include "dcmp_protocol_hash.h"

#define ROOM 64u

struct rig {
    struct dcmp_device device;
    struct dcmp_port port;
    uint32_t now_us;
    uint32_t counts;
    uint32_t period_us;
    uint16_t greeted; /* the session of the newest HELLO with the right hash that went in */
    bool was_running;
};

static void require(bool holds)
{
    if (!holds) {
        abort();
    }
}

/* What must hold at any moment, whatever came in. */
static void judge(struct rig *rig, struct dcmp_output output)
{
    const struct dcmp_device *device = &rig->device;
    const bool running = device->supervisor.state == DCMP_RUN;
    const int32_t limit = device->parameters.value[DCMP_VOLTAGE_LIMIT_MV];
    require(output.enable == running);
    require(running || output.voltage_mV == 0);
    require(output.voltage_mV <= limit && output.voltage_mV >= -limit);
    require((uint32_t)device->supervisor.state <= (uint32_t)DCMP_FAULTED);
    require((device->supervisor.fault.code != 0u) == (device->supervisor.state == DCMP_FAULTED));
    if (running) {
        require(device->session.owner != 0u && device->session.owner == rig->greeted);
        require(rig->now_us - device->watchdog.fed_us <= 50000u);
        require(device->link_up || !rig->was_running);
    }
    rig->was_running = running;
}

/* A second opinion on who may own the device: any HELLO that gets through with the right hash while nobody does. */
static void watch(struct rig *rig, const struct dcmp_frame *frame)
{
    struct dcmp_hello hello;
    if (rig->device.session.owner != 0u || dcmp_check(frame, rig->device.node) != DCMP_GENUINE) {
        return;
    }
    if ((frame->id & 0x7F0u) != DCMP_HELLO) {
        return;
    }
    dcmp_unpack_hello(frame, &hello);
    if (hello.protocol_hash == DCMP_PROTOCOL_HASH) {
        rig->greeted = hello.session;
    }
}

/* The port's own receivers run a second time beside it, to see what goes in. */
static void feed(struct rig *rig, const uint8_t *bytes, size_t length)
{
    uint8_t out[ROOM];
    for (size_t i = 0; i < length; i++) {
        struct dcmp_port beside = rig->port;
        struct dcmp_frame frame;
        const enum dcmp_received received = beside.carrier == DCMP_CARRIER_COBS
                                                ? dcmp_cobs_receive(&beside.cobs, bytes[i], &frame)
                                                : dcmp_slcan_receive(&beside.slcan, bytes[i], &frame);
        (void)dcmp_device_output(&rig->device, rig->now_us); /* the lease is looked at before anything is taken */
        if (received == DCMP_FRAME) {
            watch(rig, &frame);
        }
        require(dcmp_port_receive(&rig->port, &rig->device, &bytes[i], 1, rig->now_us, out, i % ROOM) <= i % ROOM);
        judge(rig, dcmp_device_output(&rig->device, rig->now_us));
    }
}

static void tick(struct rig *rig, uint32_t step)
{
    const struct dcmp_edge edge = {rig->counts, (uint16_t)step, -1, (step & 1u) != 0u};
    uint8_t out[ROOM];
    rig->now_us += rig->period_us;
    rig->counts += step;
    judge(rig, dcmp_device_tick(&rig->device, rig->now_us, rig->counts, &edge));
    if ((step & 4u) == 0u) {
        require(dcmp_port_transmit(&rig->port, &rig->device, out, sizeof out) <= sizeof out);
    }
}

/* What happens between two pieces. */
static void happen(struct rig *rig, uint8_t what)
{
    switch (what & 7u) {
    case 0:
    case 1:
        tick(rig, what >> 6);
        break;
    case 2:
        tick(rig, (uint32_t)what << 8);
        break;
    case 3:
        for (uint32_t i = 0; i < what; i++) {
            tick(rig, 0);
        }
        break;
    case 4:
        rig->now_us += (uint32_t)what << 4;
        break;
    case 5:
        dcmp_device_link(&rig->device, (what & 0x80u) != 0u, rig->now_us);
        break;
    case 6:
        dcmp_device_late_tick(&rig->device);
        dcmp_device_idle(&rig->device, what);
        dcmp_device_overrun(&rig->device);
        break;
    default:
        break;
    }
    judge(rig, dcmp_device_output(&rig->device, rig->now_us));
}

uint32_t fuzz_runs; /* inputs that reached RUN: a fuzzer that never does proves little */

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct rig rig = {.greeted = 0, .counts = 0, .was_running = false};
    const uint8_t first = size > 0u ? data[0] : 0u;
    const struct dcmp_config config = {
        .board = 2, .counts_per_rev = 4096, .period_us = (first & 8u) != 0u ? 100 : 1000, .voltage_limit_mV = 10000,
        .slew_mV_per_ms = (first & 2u) != 0u ? 100 : 0, .watchdog_ms = 20, .speed_limit_counts_s = 40000,
        .travel_limit_counts = 20000, .node = first >> 4, .edge_stamps = true,
    };
    rig.period_us = (uint32_t)config.period_us;
    rig.now_us = (first & 4u) != 0u ? 0xFFFF0000u : 0u;
    require(dcmp_device_init(&rig.device, &config, rig.now_us));
    dcmp_port_init(&rig.port, (first & 1u) != 0u ? DCMP_CARRIER_SLCAN : DCMP_CARRIER_COBS);
    bool ran = false;
    for (size_t i = 1; i < size;) {
        const uint8_t what = data[i++];
        size_t piece = i < size ? data[i++] & 31u : 0u;
        piece = piece < size - i ? piece : size - i;
        feed(&rig, &data[i], piece);
        ran = ran || rig.was_running;
        happen(&rig, what);
        i += piece;
    }
    fuzz_runs += ran ? 1u : 0u;
    return 0;
}
