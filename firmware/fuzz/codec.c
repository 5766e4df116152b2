#include "codec.h"

#include <string.h>

#include "dcmp_crc.h"
#include "dcmp_message.h"
#include "wire.h"

#define RETURN_OF(name, structure)                                                                                     \
    static void return_##name(const struct dcmp_frame *from, struct dcmp_frame *to)                                    \
    {                                                                                                                  \
        struct dcmp_##structure message;                                                                               \
        dcmp_unpack_##name(from, &message);                                                                            \
        dcmp_pack_##name(to, (uint8_t)(from->id % 16u), &message);                                                     \
    }

RETURN_OF(stop, stop)
RETURN_OF(drive, drive)
RETURN_OF(fault, fault)
RETURN_OF(sample, sample)
RETURN_OF(hello, hello)
RETURN_OF(identity, identity)
RETURN_OF(parameter_get, parameter_get)
RETURN_OF(parameter_set, parameter_set)
RETURN_OF(parameter_value, parameter_value)
RETURN_OF(edge, edge_stamp)
RETURN_OF(health, health_report)

static void (*const returns[])(const struct dcmp_frame *from, struct dcmp_frame *to) = {
    [WIRE_STOP] = return_stop,         [WIRE_DRIVE] = return_drive,
    [WIRE_FAULT] = return_fault,       [WIRE_SAMPLE] = return_sample,
    [WIRE_EDGE] = return_edge,         [WIRE_HELLO] = return_hello,
    [WIRE_IDENTITY] = return_identity, [WIRE_GET] = return_parameter_get,
    [WIRE_SET] = return_parameter_set, [WIRE_VALUE] = return_parameter_value,
    [WIRE_HEALTH] = return_health,
};

/* The checksum by the core's function for whole arrays. */
static uint8_t crc8(const struct dcmp_frame *frame)
{
    uint8_t bytes[2u + DCMP_PAYLOAD_MAX] = {(uint8_t)(frame->id & 0xFFu), (uint8_t)(frame->id >> 8)};
    memcpy(&bytes[2], frame->data, frame->length);
    return dcmp_crc8(bytes, 1u + (size_t)frame->length);
}

bool codec_returns(const struct dcmp_frame *frame)
{
    struct dcmp_frame again = {0};
    returns[frame->id / 16u](frame, &again);
    return again.id == frame->id && again.length == frame->length &&
           memcmp(again.data, frame->data, frame->length) == 0 && crc8(frame) == wire_crc8(frame) &&
           dcmp_check_any(frame, (uint8_t)(frame->id % 16u)) == DCMP_GENUINE;
}
