#include "dcmp_watchdog.h"

void dcmp_watchdog_feed(struct dcmp_watchdog *watchdog, uint32_t now_us, uint32_t watchdog_ms, uint32_t ttl_ms)
{
    watchdog->fed_us = now_us;
    watchdog->time_us = 1000u * (ttl_ms < watchdog_ms ? ttl_ms : watchdog_ms);
}

/* Unsigned on purpose: a clock that steps back looks like a very long silence, and that is the safe side. */
uint32_t dcmp_watchdog_age(const struct dcmp_watchdog *watchdog, uint32_t now_us)
{
    return now_us - watchdog->fed_us;
}

bool dcmp_watchdog_expired(const struct dcmp_watchdog *watchdog, uint32_t now_us)
{
    return dcmp_watchdog_age(watchdog, now_us) > watchdog->time_us;
}
