/* How long ago the last accepted DRIVE came. */
#ifndef DCMP_WATCHDOG_H
#define DCMP_WATCHDOG_H

#include <stdbool.h>
#include <stdint.h>

struct dcmp_watchdog {
    uint32_t fed_us;
    uint32_t time_us;
};

/* Start anew: the next DRIVE is due within `watchdog_ms`, or `ttl_ms` if that is shorter. */
void dcmp_watchdog_feed(struct dcmp_watchdog *watchdog, uint32_t now_us, uint32_t watchdog_ms, uint32_t ttl_ms);

/* Right across a wrap of the timer. */
uint32_t dcmp_watchdog_age(const struct dcmp_watchdog *watchdog, uint32_t now_us);
bool dcmp_watchdog_expired(const struct dcmp_watchdog *watchdog, uint32_t now_us);

#endif
