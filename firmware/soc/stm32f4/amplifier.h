/* The amplifier of a board: its input voltage, and the line without which it does nothing. */
#ifndef AMPLIFIER_H
#define AMPLIFIER_H

#include <stdbool.h>
#include <stdint.h>

#include "clock.h"

/* How a voltage becomes what is on the pins. */
struct amplifier_scale {
    int32_t zero_code;     /* DAC: the code that is 0 V, about 2048; PWM: not used */
    int32_t full_scale_mV; /* DAC: 2048 codes from there; PWM: duty cycle 1, the motor's supply */
};

/* Whether the voltage is a part of the motor's supply: then `full_scale_mV` has to be that supply, or every limit is
 * wrong by the factor by which it is. */
bool amplifier_divides_supply(void);

/* ENABLE low, the first thing after a reset. */
void amplifier_hold(void);

/* The rest of the pins, at 0 V. */
void amplifier_start(const struct clock *clock, const struct amplifier_scale *scale);

/* 0 V, and ENABLE low before. */
void amplifier_off(const struct amplifier_scale *scale);

/* A voltage; then ENABLE high, if it was not. */
void amplifier_on(const struct amplifier_scale *scale, int16_t voltage_mV);

/* Whether the power stage reports a failure of its own, or did since the last time (boards that have such a line). It has
 * stopped by itself then; there is no interrupt, which would come again and again while the line is low. */
bool amplifier_broken(void);

#endif
