/* The complete device, for code that allocates one. Only the core accesses its members. */
#ifndef DCMP_DEVICE_STATE_H
#define DCMP_DEVICE_STATE_H

#include "dcmp_amplifier.h"
#include "dcmp_device.h"
#include "dcmp_encoder.h"
#include "dcmp_health.h"
#include "dcmp_parameters.h"
#include "dcmp_session.h"
#include "dcmp_supervisor.h"
#include "dcmp_transmit.h"
#include "dcmp_watchdog.h"

struct dcmp_device {
    bool valid; /* the configuration is; otherwise nothing ever happens */
    uint8_t node;
    uint16_t firmware_version;
    uint32_t tick;       /* of the newest SAMPLE */
    uint32_t oldest;     /* ticks that a DRIVE may be old */
    uint32_t repeat;     /* ticks between FAULTs, and between HEALTHs */
    uint32_t fault_in;   /* ticks to the next FAULT, while one is latched */
    uint32_t health_in;  /* ticks to the next HEALTH */
    bool link_up;
    bool driven; /* a DRIVE was accepted since the tick before */
    struct dcmp_supervisor supervisor;
    struct dcmp_watchdog watchdog;
    struct dcmp_encoder encoder;
    struct dcmp_amplifier amplifier;
    struct dcmp_health health;
    struct dcmp_session session;
    struct dcmp_parameters parameters;
    struct dcmp_transmit transmit;
};

#endif
