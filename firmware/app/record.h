/* What a board knows of itself, kept in two sectors of flash memory: records are written one behind the other, and when a
 * sector is full the other one is blanked. The newest that is whole counts, so that power may go at any time. */
#ifndef RECORD_H
#define RECORD_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_device.h"

#define RECORD_WORDS 20u
#define RECORD_SECTORS 2u

enum record_link { RECORD_COBS, RECORD_SLCAN, RECORD_CAN };

/* 20 words, in this order; tools/flash.py writes it too. */
struct record {
    uint32_t magic;
    uint32_t sequence; /* the newest is the highest */
    int32_t boot_count; /* the highest number that a boot may have had so far: boot_count.h */
    int32_t counts_per_rev;
    int32_t period_us;
    int32_t voltage_limit_mV;
    int32_t slew_mV_per_ms;
    int32_t watchdog_ms;
    int32_t speed_limit_counts_s;
    int32_t travel_limit_counts;
    uint32_t node;
    uint32_t link; /* enum record_link */
    uint32_t baud;
    int32_t zero_code;     /* struct amplifier_scale */
    int32_t full_scale_mV; /* the same */
    uint32_t spare[4];     /* 0 */
    uint32_t crc;          /* CRC-16 of the bytes before it */
};

struct record_place {
    uint32_t sector;
    uint32_t index;
    bool blank_first;
};

/* The newest whole one of the two sectors, each of `count` places; null if there is none. */
const struct record *record_newest(const struct record *const sectors[RECORD_SECTORS], uint32_t count);

/* Where the one after `newest` (null: the first) goes. */
struct record_place record_next(const struct record *const sectors[RECORD_SECTORS], uint32_t count,
                                const struct record *newest);

/* Finish one that is to be written. */
void record_seal(struct record *record);

#endif
