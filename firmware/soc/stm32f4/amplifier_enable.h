/* The ENABLE line, PB15: high lets the amplifier work, a resistor pulls it down when no pin drives it. */
#ifndef AMPLIFIER_ENABLE_H
#define AMPLIFIER_ENABLE_H

#include "clock.h"
#include "pins.h"

#define ENABLE_PIN 15u

static inline void enable_low(void)
{
    pin_write(GPIOB, ENABLE_PIN, false);
}

static inline void enable_high(void)
{
    pin_write(GPIOB, ENABLE_PIN, true);
}

/* Low before the pin becomes an output. */
static inline void enable_hold(void)
{
    clock_enable(&RCC->AHB1ENR, RCC_AHB1ENR_GPIOBEN);
    enable_low();
    pin_set_up(GPIOB, ENABLE_PIN, PIN_OUTPUT, PIN_FLOATS, 0u);
}

#endif
