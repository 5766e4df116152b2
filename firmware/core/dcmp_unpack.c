/* Frames into structures: little-endian, bit positions as in firmware/proto/dcmp.dbc. */
#include "dcmp_message.h"

static uint32_t get(const uint8_t *data, unsigned int bytes)
{
    uint32_t value = 0;
    for (unsigned int i = 0; i < bytes; i++) {
        value |= (uint32_t)data[i] << (8u * i);
    }
    return value;
}

static bool bit(uint32_t value, unsigned int position)
{
    return ((value >> position) & 1u) != 0u;
}

void dcmp_unpack_stop(const struct dcmp_frame *frame, struct dcmp_stop *stop)
{
    stop->reason = frame->data[0];
}

void dcmp_unpack_drive(const struct dcmp_frame *frame, struct dcmp_drive *drive)
{
    const uint32_t shared = get(&frame->data[2], 2);
    drive->voltage_mV = (int16_t)get(&frame->data[0], 2);
    drive->seq = (uint16_t)((shared >> 3) & 0x1FFFu);
    drive->arm = bit(shared, 0);
    drive->clear = bit(shared, 1);
    drive->release = bit(shared, 2);
    drive->session = (uint16_t)get(&frame->data[4], 2);
    drive->ttl_ms = frame->data[6];
}

void dcmp_unpack_fault(const struct dcmp_frame *frame, struct dcmp_fault *fault)
{
    fault->code = frame->data[0];
    fault->tick = frame->data[1];
    fault->detail = (int32_t)get(&frame->data[2], 4);
}

void dcmp_unpack_sample(const struct dcmp_frame *frame, struct dcmp_sample *sample)
{
    const uint32_t shared = frame->data[6];
    sample->position_counts = get(&frame->data[0], 3);
    sample->voltage_mV = (int16_t)get(&frame->data[3], 2);
    sample->tick = frame->data[5];
    sample->state = (uint8_t)(shared & 7u);
    sample->missed = bit(shared, 3);
    sample->limited = bit(shared, 4);
    sample->fault_class = (uint8_t)(shared >> 5);
}

void dcmp_unpack_edge(const struct dcmp_frame *frame, struct dcmp_edge_stamp *edge)
{
    edge->position_counts = get(&frame->data[0], 3);
    edge->age_us = (uint16_t)get(&frame->data[3], 2);
    edge->tick = frame->data[5];
    edge->direction = (int8_t)frame->data[6];
}

void dcmp_unpack_hello(const struct dcmp_frame *frame, struct dcmp_hello *hello)
{
    hello->session = (uint16_t)get(&frame->data[0], 2);
    hello->protocol_hash = get(&frame->data[2], 4);
}

void dcmp_unpack_identity(const struct dcmp_frame *frame, struct dcmp_identity *identity)
{
    identity->protocol_hash = get(&frame->data[0], 4);
    identity->firmware_version = (uint16_t)get(&frame->data[4], 2);
    identity->busy = bit(frame->data[6], 0);
    identity->owned = bit(frame->data[6], 1);
    identity->mismatch = bit(frame->data[6], 2);
}

void dcmp_unpack_parameter_get(const struct dcmp_frame *frame, struct dcmp_parameter_get *request)
{
    request->id = frame->data[0];
}

void dcmp_unpack_parameter_set(const struct dcmp_frame *frame, struct dcmp_parameter_set *set)
{
    set->session = (uint16_t)get(&frame->data[0], 2);
    set->id = frame->data[2];
    set->value = (int32_t)get(&frame->data[3], 4);
}

void dcmp_unpack_parameter_value(const struct dcmp_frame *frame, struct dcmp_parameter_value *value)
{
    value->id = frame->data[0];
    value->value = (int32_t)get(&frame->data[1], 4);
    value->result = frame->data[5];
}

void dcmp_unpack_health(const struct dcmp_frame *frame, struct dcmp_health_report *health)
{
    health->crc_errors = frame->data[0];
    health->sequence_gaps = frame->data[1];
    health->ring_overruns = frame->data[2];
    health->bus_offs = frame->data[3];
    health->late_ticks = frame->data[4];
    health->idle_percent = frame->data[5];
}
