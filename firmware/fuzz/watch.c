#include "watch.h"

#include <stddef.h>

#include "wire.h"

#define ARMING_DRIVES 10u

static int32_t size(int32_t value)
{
    return value < 0 ? -value : value;
}

void watch_forbid(struct watch *watch)
{
    watch->armed = 0;
}

void watch_frame(struct watch *watch, const struct dcmp_config *config, const struct dcmp_frame *frame,
                 uint32_t now_us)
{
    const uint32_t number = frame->id / 16u;
    const uint8_t length = wire_length_from_host(number);
    if (frame->id % 16u != config->node || length == 0u || frame->length != length ||
        frame->data[length - 1u] != wire_crc8(frame)) {
        return;
    }
    if (number == (uint32_t)WIRE_STOP) {
        watch->armed = 0;
    }
    if (number == (uint32_t)WIRE_DRIVE && (frame->data[2] & 7u) == 1u) {
        watch->armed++;
        watch->driven_us = now_us;
    }
}

const char *watch_output(struct watch *watch, const struct dcmp_config *config, struct dcmp_output output,
                         uint32_t now_us)
{
    if (watch->enabled && !output.enable) {
        watch->armed = 0;
    }
    watch->enabled = output.enable;
    if (!output.enable) {
        return output.voltage_mV == 0 ? NULL : "a voltage without ENABLE";
    }
    if (size(output.voltage_mV) > config->voltage_limit_mV) {
        return "a voltage above what the board was built with";
    }
    if (watch->armed < ARMING_DRIVES) {
        return "ENABLE without ten DRIVEs that arm, or after a STOP";
    }
    if (now_us - watch->driven_us > 1000u * (uint32_t)config->watchdog_ms) {
        return "ENABLE, and the host is silent for longer than the board was built for";
    }
    return watch->link_down ? "ENABLE, and the link is down" : NULL;
}

const char *watch_tick(struct watch *watch, const struct dcmp_config *config, struct dcmp_output output,
                       uint32_t now_us)
{
    const int64_t most_uV = (int64_t)config->slew_mV_per_ms * config->period_us;
    const int32_t before_mV = watch->voltage_mV;
    watch->voltage_mV = output.voltage_mV;
    if (output.enable && most_uV != 0 && (int64_t)1000 * (size(output.voltage_mV - before_mV) - 1) > most_uV) {
        return "a voltage that rises faster than the board was built for";
    }
    return watch_output(watch, config, output, now_us);
}
