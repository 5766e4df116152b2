/* A microsecond counter (TIM5) and the sample clock (TIM3), which run from the same clock and stay together. */
#ifndef TIMEBASE_H
#define TIMEBASE_H

#include <stdbool.h>
#include <stdint.h>

#define TIMEBASE_TICK_IRQ 29u

/* Free-running, 32 bits. */
void timebase_start(uint32_t timers_Hz);
uint32_t timebase_us(void);

/* A tick every `period_us`, 2..65536: an interrupt, and a pulse that latches the encoder. */
void timebase_start_ticks(uint32_t timers_Hz, uint32_t period_us);

/* Take note of the tick in its interrupt; how long ago it was, us. */
uint32_t timebase_take_tick(void);

/* Whether the next tick is due already. */
bool timebase_tick_due(void);

#endif
