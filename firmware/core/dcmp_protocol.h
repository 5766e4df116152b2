/* Generated from firmware/proto/dcmp.dbc; `make generate` writes it. */
#ifndef DCMP_PROTOCOL_H
#define DCMP_PROTOCOL_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_frame.h"

/* Identifiers of node 0. */
enum dcmp_message {
    DCMP_STOP = 0x010,
    DCMP_DRIVE = 0x020,
    DCMP_FAULT = 0x030,
    DCMP_SAMPLE = 0x040,
    DCMP_EDGE = 0x050,
    DCMP_HELLO = 0x060,
    DCMP_IDENTITY = 0x070,
    DCMP_PARAMETER_GET = 0x080,
    DCMP_PARAMETER_SET = 0x090,
    DCMP_PARAMETER_VALUE = 0x0A0,
    DCMP_HEALTH = 0x0B0
};

/* The fault that is latched. */
enum dcmp_fault_code {
    DCMP_NO_FAULT = 0,
    DCMP_HOST_SILENT = 1,
    DCMP_LINK_DOWN = 2,
    DCMP_STOPPED = 3,
    DCMP_CORRUPT_LINK = 4,
    DCMP_OVER_SPEED = 5,
    DCMP_OVER_TRAVEL = 6,
    DCMP_ENCODER_JUMP = 7,
    DCMP_BREAK_INPUT = 8,
    DCMP_INTERNAL = 9
};

/* State of a device; its amplifier is at 0 V with ENABLE low in all but RUN. */
enum dcmp_state {
    DCMP_BOOT = 0,
    DCMP_IDLE = 1,
    DCMP_ARMING = 2,
    DCMP_RUN = 3,
    DCMP_FAULTED = 4
};

/* Parameter of a device, its unit in its name. */
enum dcmp_parameter {
    DCMP_BOARD = 1,
    DCMP_BOOT_COUNT = 2,
    DCMP_RESET_CAUSE = 3,
    DCMP_TICK = 4,
    DCMP_COUNTS_PER_REV = 5,
    DCMP_PERIOD_US = 6,
    DCMP_VOLTAGE_LIMIT_MV = 7,
    DCMP_SLEW_MV_PER_MS = 8,
    DCMP_WATCHDOG_MS = 9,
    DCMP_SPEED_LIMIT_COUNTS_S = 10,
    DCMP_TRAVEL_LIMIT_COUNTS = 11,
    DCMP_EDGE_STAMPS = 12,
    DCMP_LAST_FAULT = 13,
    DCMP_LAST_FAULT_DETAIL = 14,
    DCMP_SUPPLY_MV = 15,
    DCMP_TRAVEL_ORIGIN_COUNTS = 16
};

/* Result of a request for a parameter; of several that apply, the first. */
enum dcmp_result {
    DCMP_OK = 0,
    DCMP_UNKNOWN = 1,
    DCMP_READ_ONLY = 2,
    DCMP_OUT_OF_RANGE = 3,
    DCMP_NOT_IDLE = 4,
    DCMP_NOT_OWNER = 5
};

/* By message number, which is identifier / 16: length, and whether the host sends it. */
#define DCMP_LAYOUTS { \
    {0, false},  /* no message */ \
    {2, true},   /* STOP */ \
    {8, true},   /* DRIVE */ \
    {7, false},  /* FAULT */ \
    {8, false},  /* SAMPLE */ \
    {8, false},  /* EDGE */ \
    {7, true},   /* HELLO */ \
    {8, false},  /* IDENTITY */ \
    {2, true},   /* PARAMETER_GET */ \
    {8, true},   /* PARAMETER_SET */ \
    {7, false},  /* PARAMETER_VALUE */ \
    {7, false},  /* HEALTH */ \
}

/* Identifiers, of node 0, of the messages that the host sends. */
#define DCMP_FROM_HOST { \
    DCMP_STOP, \
    DCMP_DRIVE, \
    DCMP_HELLO, \
    DCMP_PARAMETER_GET, \
    DCMP_PARAMETER_SET \
}

/* STOP: stop now; obeyed from every host, in any session. */
struct dcmp_stop {
    uint8_t reason; /* Reason for a STOP. */
};

/* DRIVE: the voltage to apply, every period, from the session that owns the device. */
struct dcmp_drive {
    int16_t voltage_mV; /* Raw amplifier millivolts. */
    uint16_t seq; /* 0..8191. Tick, modulo 8192, of the newest SAMPLE that this command was computed from. */
    bool arm; /* Asks to arm, or to stay armed. */
    bool clear; /* Asks for the end of FAULT. */
    bool release; /* Ends the ownership, and disarms. */
    uint16_t session; /* 1..65535 */
    uint8_t ttl_ms; /* 5..50. May shorten the watchdog, never lengthen it. */
};

/* FAULT: at a fault, and every 100 ms while it is latched. */
struct dcmp_fault {
    uint8_t code; /* enum dcmp_fault_code */
    uint8_t tick; /* Tick, modulo 256, at which it happened. */
    int32_t detail;
};

/* SAMPLE: every period, from boot on, in every state, to every listener. */
struct dcmp_sample {
    uint32_t position_counts; /* 0..16777215. Raw encoder count modulo 2^24, latched at the tick. */
    int16_t voltage_mV; /* Voltage that was really applied over the period that ended at this tick. */
    uint8_t tick; /* Periods since boot, modulo 256. */
    uint8_t state; /* enum dcmp_state */
    bool missed; /* No DRIVE was accepted since the tick before. */
    bool limited; /* The last command was clamped or slewed. */
    uint8_t fault_class; /* 0..7. Fault code, 7 for every code from 7 on: FAULT says which. */
};

/* EDGE: after SAMPLE, once a period, if the parameter EDGE_STAMPS asks for it. */
struct dcmp_edge_stamp {
    uint32_t position_counts; /* 0..16777215. Raw encoder count modulo 2^24 at the newest edge. */
    uint16_t age_us; /* Time from the edge to this tick; 65535 for that and more. */
    uint8_t tick; /* As in SAMPLE. */
    int8_t direction; /* -1..1. Direction of the count at the edge. */
};

/* HELLO: ask who is there; a session other than 0 also asks to own the device. */
struct dcmp_hello {
    uint16_t session; /* 0 asks only who is there. */
    uint32_t protocol_hash;
};

/* IDENTITY: the answer to HELLO. */
struct dcmp_identity {
    uint32_t protocol_hash;
    uint16_t firmware_version; /* Major * 256 + minor. */
    bool busy; /* A session owns the device, another than that of the HELLO. */
    bool owned; /* The session of the HELLO owns the device. */
    bool mismatch; /* The hash of the HELLO is not the device's. */
};

/* PARAMETER_GET: ask for a parameter. */
struct dcmp_parameter_get {
    uint8_t id; /* enum dcmp_parameter */
};

/* PARAMETER_SET: change a parameter; the owner only, in IDLE only. */
struct dcmp_parameter_set {
    uint16_t session; /* 1..65535 */
    uint8_t id; /* enum dcmp_parameter */
    int32_t value;
};

/* PARAMETER_VALUE: the answer to PARAMETER_GET and PARAMETER_SET, with the value that holds now. */
struct dcmp_parameter_value {
    uint8_t id; /* enum dcmp_parameter */
    int32_t value;
    uint8_t result; /* enum dcmp_result */
};

/* HEALTH: counters since boot that stop at 255, ten times a second. */
struct dcmp_health_report {
    uint8_t crc_errors;
    uint8_t sequence_gaps;
    uint8_t ring_overruns;
    uint8_t bus_offs;
    uint8_t late_ticks;
    uint8_t idle_percent; /* 0..100 */
};

/* Packing seals; unpacking takes a frame that was found genuine. */
void dcmp_pack_stop(struct dcmp_frame *frame, uint8_t node, const struct dcmp_stop *message);
void dcmp_pack_drive(struct dcmp_frame *frame, uint8_t node, const struct dcmp_drive *message);
void dcmp_pack_fault(struct dcmp_frame *frame, uint8_t node, const struct dcmp_fault *message);
void dcmp_pack_sample(struct dcmp_frame *frame, uint8_t node, const struct dcmp_sample *message);
void dcmp_pack_edge(struct dcmp_frame *frame, uint8_t node, const struct dcmp_edge_stamp *message);
void dcmp_pack_hello(struct dcmp_frame *frame, uint8_t node, const struct dcmp_hello *message);
void dcmp_pack_identity(struct dcmp_frame *frame, uint8_t node, const struct dcmp_identity *message);
void dcmp_pack_parameter_get(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_get *message);
void dcmp_pack_parameter_set(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_set *message);
void dcmp_pack_parameter_value(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_value *message);
void dcmp_pack_health(struct dcmp_frame *frame, uint8_t node, const struct dcmp_health_report *message);

void dcmp_unpack_stop(const struct dcmp_frame *frame, struct dcmp_stop *message);
void dcmp_unpack_drive(const struct dcmp_frame *frame, struct dcmp_drive *message);
void dcmp_unpack_fault(const struct dcmp_frame *frame, struct dcmp_fault *message);
void dcmp_unpack_sample(const struct dcmp_frame *frame, struct dcmp_sample *message);
void dcmp_unpack_edge(const struct dcmp_frame *frame, struct dcmp_edge_stamp *message);
void dcmp_unpack_hello(const struct dcmp_frame *frame, struct dcmp_hello *message);
void dcmp_unpack_identity(const struct dcmp_frame *frame, struct dcmp_identity *message);
void dcmp_unpack_parameter_get(const struct dcmp_frame *frame, struct dcmp_parameter_get *message);
void dcmp_unpack_parameter_set(const struct dcmp_frame *frame, struct dcmp_parameter_set *message);
void dcmp_unpack_parameter_value(const struct dcmp_frame *frame, struct dcmp_parameter_value *message);
void dcmp_unpack_health(const struct dcmp_frame *frame, struct dcmp_health_report *message);

#endif
