/* libFuzzer's entry. An input is a program: its first two bytes choose a board, the state that it begins in and what
 * carries the frames; each of the rest is an operation, with operands behind it. Frames are made here, their checksums
 * with them, so that a mutation gets as deep as a host does.
 *
 * An execution is what is counted: it has the ticks and the frames that its input asks for, those of the state that it
 * begins in not among them. */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dcmp_protocol_hash.h"
#include "stages.h"

#define TICKS_MAX 64u
#define STRANGER 0x4321u

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

struct input {
    const uint8_t *bytes;
    size_t left;
};

struct statistics {
    unsigned long long executions, ticks, ticks_with_frames, ran;
};

static struct statistics statistics;

static void report(void)
{
    (void)fprintf(stderr, "executions %llu, ticks %llu, ticks with frames %llu, executions in RUN %llu\n",
                  statistics.executions, statistics.ticks, statistics.ticks_with_frames, statistics.ran);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    wire_prepare();
    (void)atexit(report);
    return 0;
}

static uint32_t next(struct input *input)
{
    if (input->left == 0u) {
        return 0;
    }
    input->left--;
    return *input->bytes++;
}

static uint32_t next_16(struct input *input)
{
    const uint32_t low = next(input);
    return low + 256u * next(input);
}

static void tick(struct rig *rig, int32_t step)
{
    const struct dcmp_edge edge = {rig->counts, (uint16_t)(step * 77), step < 0 ? -1 : 1, (step & 1) != 0};
    if (rig->ticks < TICKS_MAX) {
        rig_tick(rig, step, step == 0 ? NULL : &edge);
    }
}

/* The encoder turns, by little or by much, once or twice, and no frame comes. */
static void turn(struct rig *rig, uint32_t how, struct input *input)
{
    const uint32_t asked = next_16(input);
    const int32_t step = (how & 1u) != 0u ? (int32_t)(asked << 8) : (int16_t)asked;
    tick(rig, step);
    if ((how & 2u) != 0u) {
        tick(rig, step);
    }
}

/* A good DRIVE from a healthy host, and the tick that follows. */
static void cycle(struct rig *rig, uint32_t how, struct input *input)
{
    static const int32_t steps[16] = {0, 0, 1, -1, 2, -2, 5, -5, 9, -9, 20, -20, 41, -41, 100, -100};
    const uint32_t asked = next(input);
    const int32_t voltage_mV = (int32_t)(int8_t)asked * (how % 2u == 0u ? 20 : 255);
    host_drive(rig, SESSION, asked == 0u ? 0 : voltage_mV, 1u, 0u, 50u);
    tick(rig, steps[how]);
}

/* A DRIVE that may be old, repeated, foreign, contradicting itself. */
static void odd_drive(struct rig *rig, uint32_t how, struct input *input)
{
    static const uint32_t behind[8] = {0, 0, 0, 1, 3, 4, 4096, 8191};
    static const uint32_t ttls_ms[4] = {20, 5, 4, 51};
    const uint32_t kind = next(input);
    const int32_t voltage_mV = (how & 4u) != 0u ? (int16_t)next_16(input) : 0;
    host_drive(rig, (how & 2u) != 0u && (how & 1u) != 0u ? STRANGER : SESSION, voltage_mV, kind & 7u,
               behind[(kind >> 3) & 7u], ttls_ms[kind >> 6]);
}

static void hello(struct rig *rig, uint32_t how)
{
    static const uint32_t sessions[4] = {SESSION, SESSION, STRANGER, 0};
    host_hello(rig, sessions[how & 3u], DCMP_PROTOCOL_HASH ^ ((how & 4u) != 0u ? 1u : 0u));
}

static void parameter(struct rig *rig, uint32_t how, struct input *input)
{
    const uint32_t kind = next(input);
    const uint32_t id = kind & 31u;
    const int32_t built = id < MODEL_PARAMETERS ? rig->model.built[id] : 0;
    const int32_t values[8] = {built, built / 2, built < INT32_MAX ? built + 1 : built, 0, -1, INT32_MAX, 5, 1};
    host_set(rig, (how & 7u) == 7u ? STRANGER : SESSION, id, values[kind >> 5]);
}

static void ask(struct rig *rig, uint32_t how, struct input *input)
{
    const uint32_t id = next(input);
    for (uint32_t i = 0; i <= how; i++) {
        host_get(rig, id % 20u == 19u ? id : id % 20u);
    }
}

/* What a board tells its core. */
static void board(struct rig *rig, uint32_t how, struct input *input)
{
    switch (how) {
    case 0:
    case 1:
    case 2:
        host_stop(rig, next(input));
        break;
    case 3:
    case 4:
        rig_link(rig, false);
        break;
    case 5:
    case 6:
    case 7:
        rig_link(rig, true);
        break;
    case 8:
        rig_fail(rig, 8u + next(input) % 2u, (int32_t)next_16(input) - 32768);
        break;
    case 9:
        rig_late(rig);
        break;
    case 10:
        rig_overrun(rig);
        break;
    case 11:
        rig_idle(rig, (uint8_t)next(input));
        break;
    case 12:
        rig->blocked = true;
        break;
    case 13:
        rig->blocked = false;
        break;
    default:
        rig_read(rig, next(input));
        break;
    }
}

/* A frame of any identifier, length and payload. */
static void any_frame(struct rig *rig, uint32_t how, struct input *input)
{
    static const uint8_t lengths[16] = {0, 2, 8, 7, 8, 8, 7, 8, 2, 8, 7, 7, 8, 8, 8, 8};
    struct dcmp_frame frame = wire_begin(WIRE_STOP, rig->config.node);
    const uint32_t kind = next(input);
    const uint32_t number = kind & 15u;
    const uint32_t length = (kind & 0x10u) != 0u ? lengths[number] : how % 9u;
    frame.id = (uint16_t)(number * 16u + ((kind & 0x60u) == 0x60u ? kind >> 4 : rig->config.node));
    if ((kind & 0xE0u) == 0x80u) {
        frame.id |= rig->carrier == CARRIER_CAN ? 0x400u : 0x800u; /* beyond 11 bits only bytes can say */
    }
    for (uint32_t i = 0; i + 1u < length; i++) {
        wire_put(&frame, next(input), 1);
    }
    if (length != 0u) {
        wire_seal(&frame);
        frame.data[frame.length - 1u] ^= (how & 8u) != 0u ? (uint8_t)(1u << (kind >> 5)) : 0u;
    }
    rig_frame(rig, &frame);
}

/* Lines of slcan that are no frame of this protocol, right and nearly right. */
static const char *const lines[] = {
    "C", "O", "L", "V", "N", "F", "S6", "S", "SA", "s1234", "s12345", "s123456", "sG234", "r1230", "r123A", "r8234",
    "T000001232AA5G", "T1FFFFFFF0", "T200000000", "R000001238", "R0000", "t", "t0600", "t06", "t0601", "t0609", "t060G",
    "t80111", "t06011G", "t06011111", "c", "V1", "0123456789012345678901234567890", "01234567890123456789012345678901",
};

/* Bytes without the order of frames; a port that has none gets what ended as no frame. */
static void bytes(struct rig *rig, uint32_t how, struct input *input)
{
    uint8_t piece[40];
    size_t length = 1u + (size_t)how;
    const uint32_t first = next(input);
    if (rig->carrier == CARRIER_CAN) {
        for (uint32_t i = 0; i < length; i++) {
            rig_corrupt(rig);
        }
        return;
    }
    piece[0] = (uint8_t)first;
    if (rig->ear.slcan && how >= 8u) {
        const char *line = lines[first % (sizeof lines / sizeof lines[0])];
        length = strlen(line);
        memcpy(piece, line, length);
    } else {
        for (uint32_t i = 1; i < length; i++) {
            piece[i] = (uint8_t)next(input);
        }
    }
    if ((how & 1u) == 0u) {
        piece[length++] = rig->ear.slcan ? 0x0Du : 0u;
    }
    rig_bytes(rig, piece, length, first >= 0xF0u ? first & 7u : 64u);
}

static void operate(struct rig *rig, uint32_t operation, struct input *input)
{
    const uint32_t how = operation >> 4;
    switch (operation & 15u) {
    case 0:
        turn(rig, how, input);
        return;
    case 1:
        rig_time(rig, next(input) << how);
        break;
    case 2:
        hello(rig, how);
        break;
    case 3:
        parameter(rig, how, input);
        break;
    case 4:
        ask(rig, how, input);
        break;
    case 5:
        board(rig, how, input);
        break;
    case 6:
        any_frame(rig, how, input);
        break;
    case 7:
        bytes(rig, how, input);
        break;
    case 8:
    case 9:
        odd_drive(rig, how, input);
        break;
    default:
        cycle(rig, how, input);
        return;
    }
    if ((how & 12u) != 0u) {
        tick(rig, 0);
    }
}

/* A board that was built with something out of range, or just within. */
static void start_broken(struct rig *rig, struct input *input)
{
    static const int32_t values[8] = {0, -1, 1, INT32_MAX, 50, 51, 49, 4};
    struct dcmp_config config = *stages_board(0);
    int32_t *const fields[8] = {&config.counts_per_rev, &config.period_us, &config.voltage_limit_mV,
                                &config.slew_mV_per_ms, &config.watchdog_ms, &config.speed_limit_counts_s,
                                &config.travel_limit_counts, &config.supply_mV};
    const uint32_t how = next(input);
    *fields[how & 7u] = values[(how >> 3) & 7u];
    config.node = (how & 0xC0u) == 0xC0u ? 16u : 0u;
    rig_start(rig, &config, 0u);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct rig rig;
    struct input input = {data, size};
    const uint32_t first = next(&input);
    const uint32_t carrier = next(&input) % 16u;
    if (carrier == 15u) {
        start_broken(&rig, &input);
    } else {
        rig = *stages_get(first & 7u, (first >> 3) & 7u);
    }
    rig_carrier(&rig, carrier < 11u ? CARRIER_CAN : (carrier < 13u ? CARRIER_COBS : CARRIER_SLCAN));
    while (input.left > 0u && rig.ticks < TICKS_MAX) {
        operate(&rig, next(&input), &input);
    }
    statistics.executions++;
    statistics.ticks += rig.ticks;
    statistics.ticks_with_frames += rig.ticks_with_frames;
    statistics.ran += rig.ran ? 1u : 0u;
    return 0;
}
