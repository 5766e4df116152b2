/* The voltage: clamped, and no faster than the slew limit. */
#ifndef DCMP_AMPLIFIER_H
#define DCMP_AMPLIFIER_H

#include <stdbool.h>
#include <stdint.h>

struct dcmp_amplifier {
    int32_t target_mV;  /* of the newest command */
    int32_t voltage_uV; /* microvolts: a slow slew moves less than a millivolt in a short period */
    bool limited;       /* the newest command is not what is applied */
};

/* 0 V at once, regardless of the slew limit. */
void dcmp_amplifier_cut(struct dcmp_amplifier *amplifier);

void dcmp_amplifier_command(struct dcmp_amplifier *amplifier, int16_t voltage_mV);

/* One period further towards the command; a slew of 0 is none. */
void dcmp_amplifier_step(struct dcmp_amplifier *amplifier, int32_t limit_mV, int32_t slew_mV_per_ms,
                         int32_t period_us);

int16_t dcmp_amplifier_voltage(const struct dcmp_amplifier *amplifier);

#endif
