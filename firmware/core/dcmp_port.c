#include "dcmp_port.h"

void dcmp_port_init(struct dcmp_port *port, enum dcmp_carrier carrier)
{
    port->carrier = carrier;
    dcmp_cobs_init(&port->cobs);
    dcmp_slcan_init(&port->slcan);
}

static enum dcmp_received take(struct dcmp_port *port, uint8_t byte, struct dcmp_frame *frame)
{
    if (port->carrier == DCMP_CARRIER_COBS) {
        return dcmp_cobs_receive(&port->cobs, byte, frame);
    }
    return dcmp_slcan_receive(&port->slcan, byte, frame);
}

/* slcan's answer behind what is written already, whole or not at all; returns what is written then. */
static size_t reply(const struct dcmp_port *port, uint8_t *out, size_t written, size_t room)
{
    const struct dcmp_slcan *slcan = &port->slcan;
    if (port->carrier == DCMP_CARRIER_COBS || slcan->reply_length > room - written) {
        return written;
    }
    for (size_t i = 0; i < slcan->reply_length; i++) {
        out[written + i] = slcan->reply[i];
    }
    return written + slcan->reply_length;
}

size_t dcmp_port_receive(struct dcmp_port *port, struct dcmp_device *device, const uint8_t *bytes, size_t length,
                         uint32_t now_us, uint8_t *out, size_t room)
{
    struct dcmp_frame frame;
    size_t written = 0;
    for (size_t i = 0; i < length; i++) {
        switch (take(port, bytes[i], &frame)) {
        case DCMP_FRAME:
            dcmp_device_receive(device, &frame, now_us);
            break;
        case DCMP_CORRUPT:
            dcmp_device_corrupt(device, now_us);
            written = reply(port, out, written, room);
            break;
        case DCMP_REPLY:
            written = reply(port, out, written, room);
            break;
        default:
            break;
        }
    }
    return written;
}

static size_t encode(const struct dcmp_port *port, const struct dcmp_frame *frame, uint8_t *out)
{
    if (port->carrier == DCMP_CARRIER_COBS) {
        return dcmp_cobs_send(frame, out);
    }
    return port->slcan.open ? dcmp_slcan_send(frame, out) : 0u; /* closed: dropped, not kept for later */
}

size_t dcmp_port_transmit(const struct dcmp_port *port, struct dcmp_device *device, uint8_t *out, size_t room)
{
    const size_t longest = port->carrier == DCMP_CARRIER_COBS ? DCMP_COBS_ENCODED_MAX : DCMP_SLCAN_ENCODED_MAX;
    struct dcmp_frame frame;
    size_t written = 0;
    while (room - written >= longest && dcmp_device_transmit(device, &frame)) {
        written += encode(port, &frame, &out[written]);
    }
    return written;
}
