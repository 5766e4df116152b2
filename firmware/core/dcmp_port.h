/* A byte port of either carrier with a device behind it: bytes in, bytes out. */
#ifndef DCMP_PORT_H
#define DCMP_PORT_H

#include <stddef.h>
#include <stdint.h>

#include "dcmp_cobs.h"
#include "dcmp_device.h"
#include "dcmp_slcan.h"

enum dcmp_carrier { DCMP_CARRIER_COBS, DCMP_CARRIER_SLCAN };

struct dcmp_port {
    enum dcmp_carrier carrier;
    struct dcmp_cobs cobs;
    struct dcmp_slcan slcan;
};

void dcmp_port_init(struct dcmp_port *port, enum dcmp_carrier carrier);

/* Hand received bytes to the device. slcan answers are written to `out` (those that do not fit are lost);
 * returns how many bytes that were. */
size_t dcmp_port_receive(struct dcmp_port *port, struct dcmp_device *device, const uint8_t *bytes, size_t length,
                         uint32_t now_us, uint8_t *out, size_t room);

/* Encode what the device wants to send, whole frames only, as long as there is room; returns the bytes written. */
size_t dcmp_port_transmit(const struct dcmp_port *port, struct dcmp_device *device, uint8_t *out, size_t room);

#endif
