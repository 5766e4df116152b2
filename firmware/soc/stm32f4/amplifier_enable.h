/* The ENABLE line: high lets the amplifier work, a resistor pulls it down when no pin drives it. */
#ifndef AMPLIFIER_ENABLE_H
#define AMPLIFIER_ENABLE_H

#include "board.h"
#include "clock.h"
#include "pins.h"

static inline void enable_low(void)
{
    pin_write(BOARD_ENABLE, false);
}

static inline void enable_high(void)
{
    pin_write(BOARD_ENABLE, true);
}

/* Low before the pin becomes an output. */
static inline void enable_hold(void)
{
    clock_enable(&RCC->AHB1ENR, pin_clock(BOARD_ENABLE));
    enable_low();
    pin_set_up(BOARD_ENABLE, PIN_OUTPUT, PIN_FLOATS, 0u);
}

#endif
