/* The core as a process: its host behind a pseudo terminal, its plant behind the plant port.
 *
 *     dcmp-native --link cobs|slcan --plant-fd N [field=value ...]
 *
 * The fields are those of struct dcmp_config. The first line on standard output is the path that the host opens. */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "dcmp_device.h"
#include "dcmp_device_state.h"
#include "dcmp_port.h"
#include "plant_port.h"
#include "pty.h"

#define LOOK_MS 5 /* for a host that opens the link, between two ticks that are far apart */
#define CHUNK 512u
#define ROOM 1024u /* bytes: more than the device ever has to say at once */

enum { OK = 0, USAGE = 2, NO_PORT = 3 };

struct options {
    enum dcmp_carrier carrier;
    int plant;
    struct dcmp_config config;
};

struct board {
    struct dcmp_device device;
    struct dcmp_port port;
    int master;
    int plant;
    bool link_up;
    uint8_t rest[ROOM]; /* of frames that have begun to go out */
    size_t rest_length;
    bool answered; /* by the host, since the newest tick */
    bool inside; /* a frame that has begun */
    uint8_t frame_end;
    bool plant_time;
    uint32_t period_us;
    uint32_t tick_us;
    uint64_t tick_at_us; /* of the wall's clock */
    struct dcmp_output output;
    uint32_t since_us;
};

/* ------------------------------------------------------------------------------------------ clock */

static uint64_t wall_us(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1000000u * (uint64_t)now.tv_sec + (uint64_t)now.tv_nsec / 1000u;
}

/* A plant that stops stops the time: a debugger on it must not look like a silent host. */
static uint32_t now_us(const struct board *board)
{
    if (board->plant_time) {
        return board->tick_us;
    }
    const uint64_t elapsed_us = wall_us() - board->tick_at_us;
    return board->tick_us + (elapsed_us < board->period_us ? (uint32_t)elapsed_us : board->period_us);
}

/* ------------------------------------------------------------------------------------------ plant */

static bool read_all(int port, uint8_t *bytes, size_t length)
{
    size_t got = 0;
    while (got < length) {
        const ssize_t more = read(port, &bytes[got], length - got);
        if (more == 0 || (more < 0 && errno != EINTR)) {
            return false;
        }
        got += more > 0 ? (size_t)more : 0u;
    }
    return true;
}

/* A plant that does not read any more has ended: so does the next read. */
static void write_all(int port, const uint8_t *bytes, size_t length)
{
    size_t sent = 0;
    while (sent < length) {
        const ssize_t more = write(port, &bytes[sent], length - sent);
        if (more < 0 && errno != EINTR) {
            return;
        }
        sent += more > 0 ? (size_t)more : 0u;
    }
}

/* Keep the output that the core decided on at `decided_us`; returns whether it is another one. Its instant is the
 * core's: a process that waits for its processor between decision and stamp would show the computer's lateness as the
 * watchdog's. */
static bool take_output(struct board *board, struct dcmp_output output, uint32_t decided_us)
{
    const bool changed = output.voltage_mV != board->output.voltage_mV || output.enable != board->output.enable;
    board->output = output;
    if (changed) {
        board->since_us = decided_us;
    }
    return changed;
}

static void tell_plant(const struct board *board, bool unasked)
{
    uint8_t bytes[PLANT_OUTPUT_BYTES];
    const struct plant_output output = {
        .now_us = now_us(board),
        .since_us = board->since_us,
        .fed_us = board->device.watchdog.fed_us,
        .voltage_mV = board->output.voltage_mV,
        .enable = board->output.enable,
        .state = (uint8_t)board->device.supervisor.state,
        .owner = board->device.session.owner,
        .fault = board->device.supervisor.fault.code,
        .unasked = unasked,
        .link_up = board->link_up,
    };
    plant_pack_output(&output, bytes);
    write_all(board->plant, bytes, sizeof bytes);
}

/* ------------------------------------------------------------------------------------------- link */

/* Send the rest of what did not fit; true if there is none any more. */
static bool send_rest(struct board *board)
{
    const size_t sent = pty_write(board->master, board->rest, board->rest_length);
    board->rest_length -= sent;
    memmove(board->rest, &board->rest[sent], board->rest_length);
    return board->rest_length == 0u;
}

/* Frames go out whole or not at all: where a reader is slow, the end of one that has begun waits for room. */
static void send(struct board *board, const uint8_t *bytes, size_t length)
{
    if (length == 0u || !board->link_up) {
        return;
    }
    if (!send_rest(board)) {
        dcmp_device_overrun(&board->device);
        return;
    }
    const size_t sent = pty_write(board->master, bytes, length);
    board->rest_length = length - sent;
    memcpy(board->rest, &bytes[sent], board->rest_length);
}

static void send_all(struct board *board)
{
    uint8_t bytes[ROOM];
    const size_t length = dcmp_port_transmit(&board->port, &board->device, bytes, sizeof bytes);
    send(board, bytes, length);
}

/* Whether a frame has ended in these bytes, good or bad. */
static bool has_frame(struct board *board, const uint8_t *bytes, size_t length)
{
    bool ended = false;
    for (size_t i = 0; i < length; i++) {
        if (bytes[i] != board->frame_end) {
            board->inside = true;
        } else if (board->inside) {
            board->inside = false;
            ended = true;
        } else {
            /* an end behind an end */
        }
    }
    return ended;
}

static void link_opened(struct board *board)
{
    board->link_up = true;
    dcmp_device_link(&board->device, true, now_us(board));
}

static void link_closed(struct board *board)
{
    board->link_up = false;
    dcmp_device_link(&board->device, false, now_us(board));
    board->rest_length = 0;
    pty_flush(board->master); /* the next host is not to read what was meant for this one */
}

static void serve_link(struct board *board)
{
    uint8_t bytes[CHUNK];
    const ssize_t length = pty_read(board->master, bytes, sizeof bytes);
    if (length < 0) {
        link_closed(board);
    } else {
        uint8_t replies[ROOM];
        const size_t got = (size_t)length;
        const bool whole = has_frame(board, bytes, got);
        const size_t replied =
            dcmp_port_receive(&board->port, &board->device, bytes, got, now_us(board), replies, sizeof replies);
        board->answered = board->answered || (whole && !dcmp_device_waits(&board->device));
        send(board, replies, replied);
        send_all(board);
    }
}

static void look_at_output(struct board *board)
{
    const uint32_t now = now_us(board);
    if (take_output(board, dcmp_device_output(&board->device, now), now)) {
        tell_plant(board, true);
    }
}

static void look_for_host(struct board *board)
{
    if (!board->link_up && pty_in_use(board->master)) {
        link_opened(board);
    }
}

/* ------------------------------------------------------------------------------------------- tick */

static void wait_for_host(struct board *board, uint16_t wait_ms)
{
    const uint64_t until_us = wall_us() + 1000u * (uint64_t)wait_ms;
    uint64_t wall = wall_us();
    while (!board->answered && board->link_up && wall < until_us) {
        struct pollfd port = {.fd = board->master, .events = POLLIN};
        if (poll(&port, 1, (int)((until_us - wall + 999u) / 1000u)) > 0) {
            serve_link(board);
        }
        wall = wall_us();
    }
    const uint32_t now = now_us(board);
    (void)take_output(board, dcmp_device_output(&board->device, now), now);
}

/* False at the end of the stream. */
static bool serve_plant(struct board *board)
{
    uint8_t bytes[PLANT_TICK_BYTES];
    struct plant_tick tick;
    if (!read_all(board->plant, bytes, sizeof bytes)) {
        return false;
    }
    plant_unpack_tick(bytes, &tick);
    board->plant_time = tick.plant_time;
    board->tick_us = tick.now_us;
    board->tick_at_us = wall_us();
    board->answered = false;
    look_for_host(board);
    (void)take_output(board, dcmp_device_tick(&board->device, tick.now_us, tick.counts, NULL), tick.now_us);
    send_all(board);
    if (tick.wait_ms > 0u) {
        wait_for_host(board, tick.wait_ms);
    }
    tell_plant(board, false);
    return true;
}

static void serve(struct board *board)
{
    bool going = true;
    while (going) {
        struct pollfd ports[2] = {
            {.fd = board->plant, .events = POLLIN},
            {.fd = board->link_up ? board->master : -1, .events = POLLIN}, /* a closed one would never let it wait */
        };
        poll(ports, 2, board->link_up ? -1 : LOOK_MS);
        if (ports[1].revents != 0) {
            serve_link(board);
            look_at_output(board);
        }
        look_for_host(board);
        if (ports[0].revents != 0) {
            going = serve_plant(board);
        }
    }
}

/* ------------------------------------------------------------------------------------------ start */

static bool is(const char *argument, const char *name)
{
    const size_t length = strlen(name);
    return strncmp(argument, name, length) == 0 && argument[length] == '=';
}

static bool take_field(struct dcmp_config *config, const char *argument)
{
    const struct {
        const char *name;
        int32_t *at;
    } fields[] = {
        {"board", &config->board},
        {"boot_count", &config->boot_count},
        {"reset_cause", &config->reset_cause},
        {"counts_per_rev", &config->counts_per_rev},
        {"period_us", &config->period_us},
        {"voltage_limit_mV", &config->voltage_limit_mV},
        {"slew_mV_per_ms", &config->slew_mV_per_ms},
        {"watchdog_ms", &config->watchdog_ms},
        {"speed_limit_counts_s", &config->speed_limit_counts_s},
        {"travel_limit_counts", &config->travel_limit_counts},
        {"last_fault", &config->last_fault},
        {"last_fault_detail", &config->last_fault_detail},
        {"supply_mV", &config->supply_mV},
    };
    const char *equals = strchr(argument, '=');
    const long value = equals == NULL ? 0 : strtol(&equals[1], NULL, 10);
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        if (is(argument, fields[i].name)) {
            *fields[i].at = (int32_t)value;
            return true;
        }
    }
    if (is(argument, "firmware_version")) {
        config->firmware_version = (uint16_t)value;
        return true;
    }
    if (is(argument, "node")) {
        config->node = (uint8_t)value;
        return true;
    }
    return is(argument, "edge_stamps"); /* a plant port stamps nothing */
}

static bool take_carrier(struct options *options, const char *name)
{
    options->carrier = strcmp(name, "slcan") == 0 ? DCMP_CARRIER_SLCAN : DCMP_CARRIER_COBS;
    return strcmp(name, "slcan") == 0 || strcmp(name, "cobs") == 0;
}

static bool take_options(struct options *options, int count, char **arguments)
{
    bool good = true;
    for (int i = 1; i < count; i++) {
        if (strcmp(arguments[i], "--link") == 0 && i + 1 < count) {
            good = take_carrier(options, arguments[++i]) && good;
        } else if (strcmp(arguments[i], "--plant-fd") == 0 && i + 1 < count) {
            options->plant = (int)strtol(arguments[++i], NULL, 10);
        } else {
            good = take_field(&options->config, arguments[i]) && good;
        }
    }
    return good && options->plant >= 0;
}

int main(int count, char **arguments)
{
    static struct board board;
    struct options options = {.carrier = DCMP_CARRIER_COBS, .plant = -1};
    if (!take_options(&options, count, arguments) || !dcmp_device_init(&board.device, &options.config, 0)) {
        fprintf(stderr, "usage: dcmp-native --link cobs|slcan --plant-fd N field=value ...\n");
        return USAGE;
    }
    signal(SIGPIPE, SIG_IGN); /* a plant that has gone is the end of a stream, no more */
    dcmp_port_init(&board.port, options.carrier);
    board.frame_end = options.carrier == DCMP_CARRIER_COBS ? 0u : '\r';
    board.plant = options.plant;
    board.period_us = (uint32_t)options.config.period_us;
    board.plant_time = true; /* until the first tick says otherwise */
    board.master = pty_open();
    if (board.master < 0) {
        perror("pseudo terminal");
        return NO_PORT;
    }
    printf("%s\n", ptsname(board.master));
    fflush(stdout);
    serve(&board);
    return OK;
}
