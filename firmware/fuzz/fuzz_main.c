/* Where there is no libFuzzer: seeded mutations of valid streams. usage: fuzz_main EXECUTIONS SEED
 * Prints executions, how many reached RUN, and their rate. An input that aborts is printed in hex before. */
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "dcmp_cobs.h"
#include "dcmp_message.h"
#include "dcmp_protocol_hash.h"
#include "dcmp_slcan.h"
#include "fuzz_port.h"

#define INPUT_MAX 1024u
#define SESSION 0x1234u
#define CORPUS 64u

struct input {
    uint8_t bytes[INPUT_MAX];
    size_t length;
};

static struct input current; /* for the report of a crash */

static uint32_t chance(uint32_t *seed, uint32_t below)
{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 17;
    *seed ^= *seed << 5;
    return *seed % below;
}

static void add(struct input *input, uint8_t what, const struct dcmp_frame *frame)
{
    uint8_t piece[DCMP_SLCAN_ENCODED_MAX];
    const bool slcan = (input->bytes[0] & 1u) != 0u;
    const size_t length = slcan ? dcmp_slcan_send(frame, piece) : dcmp_cobs_send(frame, piece);
    if (input->length + length + 2u <= INPUT_MAX) {
        input->bytes[input->length++] = what;
        input->bytes[input->length++] = (uint8_t)length;
        memcpy(&input->bytes[input->length], piece, length);
        input->length += length;
    }
}

static void add_drive(struct input *input, uint8_t node, int16_t voltage_mV, uint16_t seq, uint32_t flags)
{
    struct dcmp_frame frame;
    const struct dcmp_drive drive = {voltage_mV, seq, (flags & 1u) != 0u, (flags & 2u) != 0u, (flags & 4u) != 0u,
                                     SESSION, 20};
    dcmp_pack_drive(&frame, node, &drive);
    add(input, 0, &frame);
}

/* A host that says hello, arms, drives, and then does one thing or another. */
static void valid_stream(struct input *input, uint32_t *seed)
{
    struct dcmp_frame frame;
    const uint32_t wrong = chance(seed, 4) == 0u ? 1u : 0u; /* now and then a host of another version */
    const struct dcmp_hello hello = {SESSION, DCMP_PROTOCOL_HASH ^ wrong};
    const struct dcmp_stop stop = {3};
    const struct dcmp_parameter_get get = {(uint8_t)chance(seed, 14)};
    const struct dcmp_parameter_set set = {SESSION, (uint8_t)(7u + chance(seed, 6)), (int32_t)chance(seed, 12000)};
    const uint8_t node = (uint8_t)chance(seed, 16);
    uint16_t seq = 0;
    input->bytes[0] = (uint8_t)(((uint32_t)node << 4) | chance(seed, 16));
    input->bytes[1] = 0; /* the first tick */
    input->bytes[2] = 0;
    input->length = 3;
    dcmp_pack_hello(&frame, node, &hello);
    add(input, 7, &frame);
    dcmp_pack_parameter_set(&frame, node, &set);
    add(input, 7, &frame);
    for (uint32_t i = 0; i < 10u; i++) {
        add_drive(input, node, 0, seq++, 1);
    }
    for (uint32_t i = chance(seed, 6); i > 0u; i--) {
        add_drive(input, node, (int16_t)(chance(seed, 65536) - 32768u), seq++, 1);
    }
    switch (chance(seed, 4)) {
    case 0:
        dcmp_pack_stop(&frame, node, &stop);
        add(input, 0, &frame);
        add_drive(input, node, 0, seq++, 0);
        add_drive(input, node, 0, seq++, 2);
        break;
    case 1:
        add_drive(input, node, 0, seq++, 5);
        break;
    case 2:
        dcmp_pack_parameter_get(&frame, node, &get);
        add(input, 3, &frame);
        break;
    default:
        break;
    }
    for (uint32_t i = 0; i < 4u; i++) {
        add_drive(input, node, 900, seq++, 1);
    }
}

static void mutate(struct input *input, const struct input *other, uint32_t *seed)
{
    for (uint32_t times = chance(seed, 5); times > 0u; times--) {
        const size_t at = chance(seed, (uint32_t)input->length);
        const size_t rest = input->length - at;
        const size_t some = 1u + chance(seed, (uint32_t)(rest < 40u ? rest : 40u));
        switch (chance(seed, 6)) {
        case 0: /* flip a bit */
            input->bytes[at] = (uint8_t)(input->bytes[at] ^ (1u << chance(seed, 8)));
            break;
        case 1: /* another byte */
            input->bytes[at] = (uint8_t)chance(seed, 256);
            break;
        case 2: /* drop some */
            memmove(&input->bytes[at], &input->bytes[at + some], rest - some);
            input->length -= some < input->length ? some : 0u;
            break;
        case 3: /* repeat some */
            if (input->length + some <= INPUT_MAX) {
                memmove(&input->bytes[at + some], &input->bytes[at], rest);
                input->length += some;
            }
            break;
        case 4: /* go on as another input does */
            memcpy(&input->bytes[at], &other->bytes[at], INPUT_MAX - at);
            input->length = other->length > at ? other->length : at + 1u;
            break;
        default: /* stop here */
            input->length = at + 1u;
            break;
        }
    }
}

static void show(int number)
{
    static const char digits[] = "0123456789abcdef";
    (void)number;
    for (size_t i = 0; i < current.length; i++) {
        const char pair[2] = {digits[current.bytes[i] >> 4], digits[current.bytes[i] & 15u]};
        (void)!write(2, pair, 2);
    }
    (void)!write(2, "\n", 1);
    (void)signal(SIGABRT, SIG_DFL);
    abort();
}

int main(int argc, char **argv)
{
    static struct input corpus[CORPUS];
    const unsigned long executions = argc > 1 ? strtoul(argv[1], NULL, 10) : 200000ul;
    uint32_t seed = argc > 2 ? (uint32_t)strtoul(argv[2], NULL, 10) | 1u : 1u;
    struct timespec from;
    struct timespec to;
    (void)signal(SIGABRT, show);
    for (uint32_t i = 0; i < CORPUS; i++) {
        valid_stream(&corpus[i], &seed);
    }
    (void)clock_gettime(CLOCK_MONOTONIC, &from);
    for (unsigned long i = 0; i < executions; i++) {
        current = corpus[chance(&seed, CORPUS)];
        mutate(&current, &corpus[chance(&seed, CORPUS)], &seed);
        (void)LLVMFuzzerTestOneInput(current.bytes, current.length);
    }
    (void)clock_gettime(CLOCK_MONOTONIC, &to);
    const double seconds = (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
    (void)printf("%lu executions, %u in RUN, %.0f a second\n", executions, (unsigned int)fuzz_runs,
                 (double)executions / seconds);
    return 0;
}
