/* The clock tree: 168 MHz from the crystal, from the internal oscillator where that fails, 16 MHz where all fails. */
#ifndef CLOCK_H
#define CLOCK_H

#include <stdbool.h>
#include <stdint.h>

enum clock_source {
    CLOCK_CRYSTAL,
    CLOCK_INTERNAL, /* within some percent: good enough for a UART, not for CAN */
    CLOCK_SLOW      /* internal, 16 MHz, as after a reset */
};

struct clock {
    enum clock_source source;
    uint32_t core_Hz;
    uint32_t apb1_Hz;
    uint32_t apb2_Hz;
    uint32_t apb1_timers_Hz;
    uint32_t apb2_timers_Hz;
};

/* Start it, once after a reset. Every wait is bounded. A crystal that stops later is an NMI. */
struct clock clock_start(uint32_t crystal_Hz);

/* Switch a peripheral's clock on, and wait until it can be spoken to: what is written at once is lost (errata). */
void clock_enable(volatile uint32_t *enables, uint32_t bit);

/* Whether an NMI says that the crystal stopped; takes note of it. */
bool clock_crystal_stopped(void);

#endif
