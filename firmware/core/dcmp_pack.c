/* Generated from firmware/proto/dcmp.dbc; `make generate` writes it. */
/* Structures into frames: little-endian, bit positions as in the DBC. */
#include "dcmp_message.h"

static uint32_t bit(bool value, unsigned int position)
{
    return value ? 1u << position : 0u;
}

static void put(uint8_t *data, uint32_t value, unsigned int bytes)
{
    for (unsigned int i = 0; i < bytes; i++) {
        data[i] = (uint8_t)((value >> (8u * i)) & 0xFFu);
    }
}

void dcmp_pack_stop(struct dcmp_frame *frame, uint8_t node, const struct dcmp_stop *message)
{
    put(&frame->data[0], message->reason, 1);
    dcmp_seal(frame, DCMP_STOP, node);
}

void dcmp_pack_drive(struct dcmp_frame *frame, uint8_t node, const struct dcmp_drive *message)
{
    const uint32_t flags_2 = bit(message->arm, 0) | bit(message->clear, 1) | bit(message->release, 2);
    put(&frame->data[0], (uint16_t)message->voltage_mV, 2);
    put(&frame->data[2], (((uint32_t)message->seq & 0x1FFFu) << 3) | flags_2, 2);
    put(&frame->data[4], message->session, 2);
    put(&frame->data[6], message->ttl_ms, 1);
    dcmp_seal(frame, DCMP_DRIVE, node);
}

void dcmp_pack_fault(struct dcmp_frame *frame, uint8_t node, const struct dcmp_fault *message)
{
    put(&frame->data[0], message->code, 1);
    put(&frame->data[1], message->tick, 1);
    put(&frame->data[2], (uint32_t)message->detail, 4);
    dcmp_seal(frame, DCMP_FAULT, node);
}

void dcmp_pack_sample(struct dcmp_frame *frame, uint8_t node, const struct dcmp_sample *message)
{
    const uint32_t flags_6 = bit(message->missed, 3) | bit(message->limited, 4);
    put(&frame->data[0], message->position_counts, 3);
    put(&frame->data[3], (uint16_t)message->voltage_mV, 2);
    put(&frame->data[5], message->tick, 1);
    put(&frame->data[6], ((uint32_t)message->state & 7u) | (((uint32_t)message->fault_class & 7u) << 5) | flags_6, 1);
    dcmp_seal(frame, DCMP_SAMPLE, node);
}

void dcmp_pack_edge(struct dcmp_frame *frame, uint8_t node, const struct dcmp_edge_stamp *message)
{
    put(&frame->data[0], message->position_counts, 3);
    put(&frame->data[3], message->age_us, 2);
    put(&frame->data[5], message->tick, 1);
    put(&frame->data[6], (uint8_t)message->direction, 1);
    dcmp_seal(frame, DCMP_EDGE, node);
}

void dcmp_pack_hello(struct dcmp_frame *frame, uint8_t node, const struct dcmp_hello *message)
{
    put(&frame->data[0], message->session, 2);
    put(&frame->data[2], message->protocol_hash, 4);
    dcmp_seal(frame, DCMP_HELLO, node);
}

void dcmp_pack_identity(struct dcmp_frame *frame, uint8_t node, const struct dcmp_identity *message)
{
    put(&frame->data[0], message->protocol_hash, 4);
    put(&frame->data[4], message->firmware_version, 2);
    put(&frame->data[6], bit(message->busy, 0) | bit(message->owned, 1) | bit(message->mismatch, 2), 1);
    dcmp_seal(frame, DCMP_IDENTITY, node);
}

void dcmp_pack_parameter_get(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_get *message)
{
    put(&frame->data[0], message->id, 1);
    dcmp_seal(frame, DCMP_PARAMETER_GET, node);
}

void dcmp_pack_parameter_set(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_set *message)
{
    put(&frame->data[0], message->session, 2);
    put(&frame->data[2], message->id, 1);
    put(&frame->data[3], (uint32_t)message->value, 4);
    dcmp_seal(frame, DCMP_PARAMETER_SET, node);
}

void dcmp_pack_parameter_value(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_value *message)
{
    put(&frame->data[0], message->id, 1);
    put(&frame->data[1], (uint32_t)message->value, 4);
    put(&frame->data[5], message->result, 1);
    dcmp_seal(frame, DCMP_PARAMETER_VALUE, node);
}

void dcmp_pack_health(struct dcmp_frame *frame, uint8_t node, const struct dcmp_health_report *message)
{
    put(&frame->data[0], message->crc_errors, 1);
    put(&frame->data[1], message->sequence_gaps, 1);
    put(&frame->data[2], message->ring_overruns, 1);
    put(&frame->data[3], message->bus_offs, 1);
    put(&frame->data[4], message->late_ticks, 1);
    put(&frame->data[5], message->idle_percent, 1);
    dcmp_seal(frame, DCMP_HEALTH, node);
}
