/* Every message of firmware/proto/dcmp.dbc as a structure, packed into frames and unpacked from them. */
#ifndef DCMP_MESSAGE_H
#define DCMP_MESSAGE_H

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

enum dcmp_state { DCMP_BOOT, DCMP_IDLE, DCMP_ARMING, DCMP_RUN, DCMP_FAULTED };

enum dcmp_fault_code {
    DCMP_NO_FAULT,
    DCMP_HOST_SILENT,
    DCMP_LINK_DOWN,
    DCMP_STOPPED,
    DCMP_CORRUPT_LINK,
    DCMP_OVER_SPEED,
    DCMP_OVER_TRAVEL,
    DCMP_ENCODER_JUMP,
    DCMP_BREAK_INPUT,
    DCMP_INTERNAL
};

enum dcmp_parameter {
    DCMP_BOARD = 1,
    DCMP_BOOT_COUNT,
    DCMP_RESET_CAUSE,
    DCMP_TICK,
    DCMP_COUNTS_PER_REV,
    DCMP_PERIOD_US,
    DCMP_VOLTAGE_LIMIT_MV,
    DCMP_SLEW_MV_PER_MS,
    DCMP_WATCHDOG_MS,
    DCMP_SPEED_LIMIT_COUNTS_S,
    DCMP_TRAVEL_LIMIT_COUNTS,
    DCMP_EDGE_STAMPS,
    DCMP_LAST_FAULT,
    DCMP_LAST_FAULT_DETAIL,
    DCMP_SUPPLY_MV,
    DCMP_TRAVEL_ORIGIN_COUNTS
};

/* In the order in which they are looked for: the first that applies is answered. */
enum dcmp_result {
    DCMP_OK,
    DCMP_UNKNOWN,
    DCMP_READ_ONLY,
    DCMP_OUT_OF_RANGE,
    DCMP_NOT_IDLE,
    DCMP_NOT_OWNER
};

struct dcmp_stop {
    uint8_t reason;
};

struct dcmp_drive {
    int16_t voltage_mV;
    uint16_t seq; /* modulo 8192 */
    bool arm;
    bool clear;
    bool release;
    uint16_t session;
    uint8_t ttl_ms;
};

struct dcmp_fault {
    uint8_t code;
    uint8_t tick;
    int32_t detail;
};

struct dcmp_sample {
    uint32_t position_counts; /* modulo 2^24 */
    int16_t voltage_mV;
    uint8_t tick;
    uint8_t state; /* 0..7, as is fault_class */
    bool missed;
    bool limited;
    uint8_t fault_class;
};

struct dcmp_edge_stamp {
    uint32_t position_counts; /* modulo 2^24 */
    uint16_t age_us;
    uint8_t tick;
    int8_t direction;
};

struct dcmp_hello {
    uint16_t session;
    uint32_t protocol_hash;
};

struct dcmp_identity {
    uint32_t protocol_hash;
    uint16_t firmware_version;
    bool busy;
    bool owned;
    bool mismatch;
};

struct dcmp_parameter_get {
    uint8_t id;
};

struct dcmp_parameter_set {
    uint16_t session;
    uint8_t id;
    int32_t value;
};

struct dcmp_parameter_value {
    uint8_t id;
    int32_t value;
    uint8_t result;
};

struct dcmp_health_report {
    uint8_t crc_errors;
    uint8_t sequence_gaps;
    uint8_t ring_overruns;
    uint8_t bus_offs;
    uint8_t late_ticks;
    uint8_t idle_percent;
};

enum dcmp_checked {
    DCMP_FOREIGN, /* another node, an unknown number or another length: to be ignored */
    DCMP_DAMAGED, /* wrong crc8 */
    DCMP_GENUINE
};

/* Whether a frame is one of the host's for this node. */
enum dcmp_checked dcmp_check(const struct dcmp_frame *frame, uint8_t node);

/* The same of any message, of either side. */
enum dcmp_checked dcmp_check_any(const struct dcmp_frame *frame, uint8_t node);

/* Set identifier, length and crc8 around a payload that is already there; the rest of the payload is zeroed. */
void dcmp_seal(struct dcmp_frame *frame, enum dcmp_message message, uint8_t node);

/* Packing seals; unpacking takes a frame that was found genuine. */
void dcmp_pack_stop(struct dcmp_frame *frame, uint8_t node, const struct dcmp_stop *stop);
void dcmp_pack_drive(struct dcmp_frame *frame, uint8_t node, const struct dcmp_drive *drive);
void dcmp_pack_fault(struct dcmp_frame *frame, uint8_t node, const struct dcmp_fault *fault);
void dcmp_pack_sample(struct dcmp_frame *frame, uint8_t node, const struct dcmp_sample *sample);
void dcmp_pack_edge(struct dcmp_frame *frame, uint8_t node, const struct dcmp_edge_stamp *edge);
void dcmp_pack_hello(struct dcmp_frame *frame, uint8_t node, const struct dcmp_hello *hello);
void dcmp_pack_identity(struct dcmp_frame *frame, uint8_t node, const struct dcmp_identity *identity);
void dcmp_pack_parameter_get(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_get *get);
void dcmp_pack_parameter_set(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_set *set);
void dcmp_pack_parameter_value(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_value *value);
void dcmp_pack_health(struct dcmp_frame *frame, uint8_t node, const struct dcmp_health_report *health);

void dcmp_unpack_stop(const struct dcmp_frame *frame, struct dcmp_stop *stop);
void dcmp_unpack_drive(const struct dcmp_frame *frame, struct dcmp_drive *drive);
void dcmp_unpack_fault(const struct dcmp_frame *frame, struct dcmp_fault *fault);
void dcmp_unpack_sample(const struct dcmp_frame *frame, struct dcmp_sample *sample);
void dcmp_unpack_edge(const struct dcmp_frame *frame, struct dcmp_edge_stamp *edge);
void dcmp_unpack_hello(const struct dcmp_frame *frame, struct dcmp_hello *hello);
void dcmp_unpack_identity(const struct dcmp_frame *frame, struct dcmp_identity *identity);
void dcmp_unpack_parameter_get(const struct dcmp_frame *frame, struct dcmp_parameter_get *get);
void dcmp_unpack_parameter_set(const struct dcmp_frame *frame, struct dcmp_parameter_set *set);
void dcmp_unpack_parameter_value(const struct dcmp_frame *frame, struct dcmp_parameter_value *value);
void dcmp_unpack_health(const struct dcmp_frame *frame, struct dcmp_health_report *health);

#endif
