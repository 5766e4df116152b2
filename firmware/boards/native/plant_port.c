#include "plant_port.h"

static uint32_t get(const uint8_t *bytes, unsigned int count)
{
    uint32_t value = 0;
    for (unsigned int i = 0; i < count; i++) {
        value |= (uint32_t)bytes[i] << (8u * i);
    }
    return value;
}

static void put(uint8_t *bytes, unsigned int count, uint32_t value)
{
    for (unsigned int i = 0; i < count; i++) {
        bytes[i] = (uint8_t)((value >> (8u * i)) & 0xFFu);
    }
}

void plant_unpack_tick(const uint8_t bytes[PLANT_TICK_BYTES], struct plant_tick *tick)
{
    tick->now_us = get(&bytes[0], 4);
    tick->counts = get(&bytes[4], 4);
    tick->wait_ms = (uint16_t)get(&bytes[8], 2);
    tick->plant_time = (bytes[10] & 1u) != 0u;
}

void plant_pack_output(const struct plant_output *output, uint8_t bytes[PLANT_OUTPUT_BYTES])
{
    put(&bytes[0], 4, output->now_us);
    put(&bytes[4], 4, output->since_us);
    put(&bytes[8], 4, output->fed_us);
    put(&bytes[12], 2, (uint16_t)output->voltage_mV);
    bytes[14] = output->enable;
    bytes[15] = output->state;
    put(&bytes[16], 2, output->owner);
    bytes[18] = output->fault;
    bytes[19] = (uint8_t)((output->unasked ? 1u : 0u) | (output->link_up ? 2u : 0u));
}
