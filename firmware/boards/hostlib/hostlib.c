/* The core as a shared library for one simulated board in a host's process, with as few calls a period as possible.
 *
 * The caller owns the memory: hostlib_size() bytes, aligned like int64_t, the first of them a `struct hostlib_view`
 * that it may read at any time. What the device sends gathers behind the view; the caller takes `out_length` bytes from
 * `out_offset` on and sets `out_length` to 0. Nothing here knows the wall clock: two calls at one instant are fine. */
#include <stddef.h>

#include "dcmp_device.h"
#include "dcmp_device_state.h"
#include "dcmp_port.h"

#define API __attribute__((visibility("default")))

#define OUT_BYTES 4096u
#define RECORD_BYTES 11u /* of HOSTLIB_FRAMES: identifier, low byte first; length; 8 bytes of data */

enum hostlib_carrier { HOSTLIB_COBS, HOSTLIB_SLCAN, HOSTLIB_FRAMES };

/* 32 bits each, in this order. */
struct hostlib_view {
    int32_t voltage_mV; /* what the amplifier has to put out now */
    int32_t enable;
    int32_t state; /* as in SAMPLE */
    int32_t fault;
    int32_t owner; /* session, 0 for none */
    int32_t link_up;
    uint32_t out_length;
    uint32_t out_offset;
};

struct hostlib {
    struct hostlib_view view;
    uint8_t out[OUT_BYTES];
    int32_t carrier;
    struct dcmp_port port;
    struct dcmp_device device;
};

API size_t hostlib_size(void);
API size_t hostlib_config_size(void);
API bool hostlib_init(struct hostlib *board, const struct dcmp_config *config, int32_t carrier, uint32_t now_us,
                      uint32_t first_tick);
API void hostlib_receive(struct hostlib *board, const uint8_t *bytes, uint32_t length, uint32_t now_us);
API void hostlib_receive_frame(struct hostlib *board, uint32_t id, const uint8_t *data, uint32_t length,
                               uint32_t now_us);
API void hostlib_tick(struct hostlib *board, uint32_t now_us, uint32_t counts);
API void hostlib_look(struct hostlib *board, uint32_t now_us);
API void hostlib_link(struct hostlib *board, bool up, uint32_t now_us);

static size_t put_records(struct dcmp_device *device, uint8_t *out, size_t room)
{
    struct dcmp_frame frame;
    size_t written = 0;
    while (room - written >= RECORD_BYTES && dcmp_device_transmit(device, &frame)) {
        uint8_t *record = &out[written];
        record[0] = (uint8_t)(frame.id & 0xFFu);
        record[1] = (uint8_t)(frame.id >> 8);
        record[2] = frame.length;
        for (size_t i = 0; i < DCMP_PAYLOAD_MAX; i++) {
            record[3u + i] = frame.data[i];
        }
        written += RECORD_BYTES;
    }
    return written;
}

static size_t put(struct hostlib *board, uint8_t *out, size_t room)
{
    if (board->carrier == HOSTLIB_FRAMES) {
        return put_records(&board->device, out, room);
    }
    return dcmp_port_transmit(&board->port, &board->device, out, room);
}

/* Take what there is to send, and say how things stand. */
static void settle(struct hostlib *board, struct dcmp_output output)
{
    struct hostlib_view *view = &board->view;
    view->out_length += (uint32_t)put(board, &board->out[view->out_length], OUT_BYTES - view->out_length);
    if (view->link_up == 0) {
        view->out_length = 0; /* no link: dropped */
    }
    view->voltage_mV = output.voltage_mV;
    view->enable = output.enable;
    view->state = (int32_t)board->device.supervisor.state;
    view->fault = board->device.supervisor.fault.code;
    view->owner = board->device.session.owner;
}

size_t hostlib_size(void)
{
    return sizeof(struct hostlib);
}

size_t hostlib_config_size(void)
{
    return sizeof(struct dcmp_config);
}

bool hostlib_init(struct hostlib *board, const struct dcmp_config *config, int32_t carrier, uint32_t now_us,
                  uint32_t first_tick)
{
    board->carrier = carrier;
    board->view.link_up = 1;
    board->view.out_length = 0;
    board->view.out_offset = (uint32_t)offsetof(struct hostlib, out);
    dcmp_port_init(&board->port, carrier == HOSTLIB_SLCAN ? DCMP_CARRIER_SLCAN : DCMP_CARRIER_COBS);
    const bool valid = dcmp_device_init(&board->device, config, now_us);
    board->device.tick = first_tick - 1u; /* as if it had been running for so long */
    settle(board, dcmp_device_output(&board->device, now_us));
    return valid;
}

void hostlib_receive(struct hostlib *board, const uint8_t *bytes, uint32_t length, uint32_t now_us)
{
    struct hostlib_view *view = &board->view;
    const size_t replied = dcmp_port_receive(&board->port, &board->device, bytes, length, now_us,
                                             &board->out[view->out_length], OUT_BYTES - view->out_length);
    view->out_length += (uint32_t)replied;
    settle(board, dcmp_device_output(&board->device, now_us));
}

void hostlib_receive_frame(struct hostlib *board, uint32_t id, const uint8_t *data, uint32_t length, uint32_t now_us)
{
    struct dcmp_frame frame = {.id = (uint16_t)id, .length = (uint8_t)length};
    for (uint32_t i = 0; i < length && i < DCMP_PAYLOAD_MAX; i++) {
        frame.data[i] = data[i];
    }
    dcmp_device_receive(&board->device, &frame, now_us);
    settle(board, dcmp_device_output(&board->device, now_us));
}

void hostlib_tick(struct hostlib *board, uint32_t now_us, uint32_t counts)
{
    settle(board, dcmp_device_tick(&board->device, now_us, counts, 0));
}

/* Between ticks: the watchdog. */
void hostlib_look(struct hostlib *board, uint32_t now_us)
{
    settle(board, dcmp_device_output(&board->device, now_us));
}

void hostlib_link(struct hostlib *board, bool up, uint32_t now_us)
{
    board->view.link_up = up;
    dcmp_device_link(&board->device, up, now_us);
    settle(board, dcmp_device_output(&board->device, now_us));
}
