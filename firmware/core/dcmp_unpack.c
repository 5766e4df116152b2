/* Generated from firmware/proto/dcmp.dbc; `make generate` writes it. */
/* Frames into structures: little-endian, bit positions as in the DBC. */
#include "dcmp_protocol.h"

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

static uint32_t bits(uint32_t value, uint32_t mask, unsigned int position)
{
    return (value >> position) & mask;
}

void dcmp_unpack_stop(const struct dcmp_frame *frame, struct dcmp_stop *message)
{
    message->reason = frame->data[0];
}

void dcmp_unpack_drive(const struct dcmp_frame *frame, struct dcmp_drive *message)
{
    const uint32_t shared_2 = get(&frame->data[2], 2);
    message->voltage_mV = (int16_t)get(&frame->data[0], 2);
    message->seq = (uint16_t)bits(shared_2, 0x1FFFu, 3);
    message->arm = bit(shared_2, 0);
    message->clear = bit(shared_2, 1);
    message->release = bit(shared_2, 2);
    message->session = (uint16_t)get(&frame->data[4], 2);
    message->ttl_ms = frame->data[6];
}

void dcmp_unpack_fault(const struct dcmp_frame *frame, struct dcmp_fault *message)
{
    message->code = frame->data[0];
    message->tick = frame->data[1];
    message->detail = (int32_t)get(&frame->data[2], 4);
}

void dcmp_unpack_sample(const struct dcmp_frame *frame, struct dcmp_sample *message)
{
    const uint32_t shared_6 = frame->data[6];
    message->position_counts = get(&frame->data[0], 3);
    message->voltage_mV = (int16_t)get(&frame->data[3], 2);
    message->tick = frame->data[5];
    message->state = (uint8_t)bits(shared_6, 7u, 0);
    message->missed = bit(shared_6, 3);
    message->limited = bit(shared_6, 4);
    message->fault_class = (uint8_t)bits(shared_6, 7u, 5);
}

void dcmp_unpack_edge(const struct dcmp_frame *frame, struct dcmp_edge_stamp *message)
{
    message->position_counts = get(&frame->data[0], 3);
    message->age_us = (uint16_t)get(&frame->data[3], 2);
    message->tick = frame->data[5];
    message->direction = (int8_t)frame->data[6];
}

void dcmp_unpack_hello(const struct dcmp_frame *frame, struct dcmp_hello *message)
{
    message->session = (uint16_t)get(&frame->data[0], 2);
    message->protocol_hash = get(&frame->data[2], 4);
}

void dcmp_unpack_identity(const struct dcmp_frame *frame, struct dcmp_identity *message)
{
    message->protocol_hash = get(&frame->data[0], 4);
    message->firmware_version = (uint16_t)get(&frame->data[4], 2);
    message->busy = bit(frame->data[6], 0);
    message->owned = bit(frame->data[6], 1);
    message->mismatch = bit(frame->data[6], 2);
}

void dcmp_unpack_parameter_get(const struct dcmp_frame *frame, struct dcmp_parameter_get *message)
{
    message->id = frame->data[0];
}

void dcmp_unpack_parameter_set(const struct dcmp_frame *frame, struct dcmp_parameter_set *message)
{
    message->session = (uint16_t)get(&frame->data[0], 2);
    message->id = frame->data[2];
    message->value = (int32_t)get(&frame->data[3], 4);
}

void dcmp_unpack_parameter_value(const struct dcmp_frame *frame, struct dcmp_parameter_value *message)
{
    message->id = frame->data[0];
    message->value = (int32_t)get(&frame->data[1], 4);
    message->result = frame->data[5];
}

void dcmp_unpack_health(const struct dcmp_frame *frame, struct dcmp_health_report *message)
{
    message->crc_errors = frame->data[0];
    message->sequence_gaps = frame->data[1];
    message->ring_overruns = frame->data[2];
    message->bus_offs = frame->data[3];
    message->late_ticks = frame->data[4];
    message->idle_percent = frame->data[5];
}
