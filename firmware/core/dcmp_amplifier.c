#include "dcmp_amplifier.h"

static int32_t clamp(int32_t value, int32_t low, int32_t high)
{
    if (value < low) {
        return low;
    }
    return value > high ? high : value;
}

void dcmp_amplifier_cut(struct dcmp_amplifier *amplifier)
{
    amplifier->target_mV = 0;
    amplifier->voltage_uV = 0;
    amplifier->limited = false;
}

void dcmp_amplifier_command(struct dcmp_amplifier *amplifier, int16_t voltage_mV)
{
    amplifier->target_mV = voltage_mV;
}

void dcmp_amplifier_step(struct dcmp_amplifier *amplifier, int32_t limit_mV, int32_t slew_mV_per_ms,
                         int32_t period_us)
{
    const int32_t target_uV = 1000 * clamp(amplifier->target_mV, -limit_mV, limit_mV);
    const int64_t reach_uV = (int64_t)slew_mV_per_ms * period_us; /* mV / ms = uV / us */
    const int32_t wanted_uV = target_uV - amplifier->voltage_uV;
    if (slew_mV_per_ms == 0 || (wanted_uV <= reach_uV && wanted_uV >= -reach_uV)) {
        amplifier->voltage_uV = target_uV;
    } else {
        amplifier->voltage_uV += (int32_t)(wanted_uV > 0 ? reach_uV : -reach_uV);
    }
    amplifier->limited = amplifier->voltage_uV != 1000 * amplifier->target_mV;
}

int16_t dcmp_amplifier_voltage(const struct dcmp_amplifier *amplifier)
{
    return (int16_t)(amplifier->voltage_uV / 1000);
}
