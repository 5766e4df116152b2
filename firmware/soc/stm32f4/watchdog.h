/* The independent watchdog: resets the chip 40 ms, at the latest, after it was fed for the last time. */
#ifndef WATCHDOG_H
#define WATCHDOG_H

/* It cannot be stopped any more. */
void watchdog_start(void);
void watchdog_feed(void);

#endif
