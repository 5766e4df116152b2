/* Who is alive: the watchdog of a chip is fed only when every task has worked. */
#ifndef LIFE_H
#define LIFE_H

#include <stdbool.h>
#include <stdint.h>

/* What has happened so far; each is written by the one who does it. */
struct life {
    volatile uint32_t ticks;      /* the sample clock rang */
    volatile uint32_t receptions; /* what came in was looked at */
    volatile uint32_t decisions;  /* the core took a period's decision */
};

/* Whether all of them have gone on since the last time this was true; `seen` remembers. */
bool life_goes_on(const struct life *life, struct life *seen);

#endif
