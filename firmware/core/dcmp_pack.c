/* Structures into frames: little-endian, bit positions as in firmware/proto/dcmp.dbc. */
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

void dcmp_pack_stop(struct dcmp_frame *frame, uint8_t node, const struct dcmp_stop *stop)
{
    put(&frame->data[0], stop->reason, 1);
    dcmp_seal(frame, DCMP_STOP, node);
}

void dcmp_pack_drive(struct dcmp_frame *frame, uint8_t node, const struct dcmp_drive *drive)
{
    const uint32_t flags = bit(drive->arm, 0) | bit(drive->clear, 1) | bit(drive->release, 2);
    put(&frame->data[0], (uint16_t)drive->voltage_mV, 2);
    put(&frame->data[2], ((uint32_t)(drive->seq & 0x1FFFu) << 3) | flags, 2);
    put(&frame->data[4], drive->session, 2);
    put(&frame->data[6], drive->ttl_ms, 1);
    dcmp_seal(frame, DCMP_DRIVE, node);
}

void dcmp_pack_fault(struct dcmp_frame *frame, uint8_t node, const struct dcmp_fault *fault)
{
    put(&frame->data[0], fault->code, 1);
    put(&frame->data[1], fault->tick, 1);
    put(&frame->data[2], (uint32_t)fault->detail, 4);
    dcmp_seal(frame, DCMP_FAULT, node);
}

void dcmp_pack_sample(struct dcmp_frame *frame, uint8_t node, const struct dcmp_sample *sample)
{
    const uint32_t flags = bit(sample->missed, 3) | bit(sample->limited, 4);
    put(&frame->data[0], sample->position_counts, 3);
    put(&frame->data[3], (uint16_t)sample->voltage_mV, 2);
    put(&frame->data[5], sample->tick, 1);
    put(&frame->data[6], (sample->state & 7u) | flags | ((sample->fault_class & 7u) << 5), 1);
    dcmp_seal(frame, DCMP_SAMPLE, node);
}

void dcmp_pack_edge(struct dcmp_frame *frame, uint8_t node, const struct dcmp_edge_stamp *edge)
{
    put(&frame->data[0], edge->position_counts, 3);
    put(&frame->data[3], edge->age_us, 2);
    put(&frame->data[5], edge->tick, 1);
    put(&frame->data[6], (uint8_t)edge->direction, 1);
    dcmp_seal(frame, DCMP_EDGE, node);
}

void dcmp_pack_hello(struct dcmp_frame *frame, uint8_t node, const struct dcmp_hello *hello)
{
    put(&frame->data[0], hello->session, 2);
    put(&frame->data[2], hello->protocol_hash, 4);
    dcmp_seal(frame, DCMP_HELLO, node);
}

void dcmp_pack_identity(struct dcmp_frame *frame, uint8_t node, const struct dcmp_identity *identity)
{
    put(&frame->data[0], identity->protocol_hash, 4);
    put(&frame->data[4], identity->firmware_version, 2);
    put(&frame->data[6], bit(identity->busy, 0) | bit(identity->owned, 1) | bit(identity->mismatch, 2), 1);
    dcmp_seal(frame, DCMP_IDENTITY, node);
}

void dcmp_pack_parameter_get(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_get *get)
{
    put(&frame->data[0], get->id, 1);
    dcmp_seal(frame, DCMP_PARAMETER_GET, node);
}

void dcmp_pack_parameter_set(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_set *set)
{
    put(&frame->data[0], set->session, 2);
    put(&frame->data[2], set->id, 1);
    put(&frame->data[3], (uint32_t)set->value, 4);
    dcmp_seal(frame, DCMP_PARAMETER_SET, node);
}

void dcmp_pack_parameter_value(struct dcmp_frame *frame, uint8_t node, const struct dcmp_parameter_value *value)
{
    put(&frame->data[0], value->id, 1);
    put(&frame->data[1], (uint32_t)value->value, 4);
    put(&frame->data[5], value->result, 1);
    dcmp_seal(frame, DCMP_PARAMETER_VALUE, node);
}

void dcmp_pack_health(struct dcmp_frame *frame, uint8_t node, const struct dcmp_health_report *health)
{
    put(&frame->data[0], health->crc_errors, 1);
    put(&frame->data[1], health->sequence_gaps, 1);
    put(&frame->data[2], health->ring_overruns, 1);
    put(&frame->data[3], health->bus_offs, 1);
    put(&frame->data[4], health->late_ticks, 1);
    put(&frame->data[5], health->idle_percent, 1);
    dcmp_seal(frame, DCMP_HEALTH, node);
}
