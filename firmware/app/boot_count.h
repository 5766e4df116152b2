/* The number of a boot. It is kept twice: in the record in flash memory, and in memory that a reset leaves alone and that is
 * lost with the power. A reset that finds the memory as the boot before left it needs no new record, so that a board that
 * restarts over and over does not wear its flash memory out.
 *
 * The record holds the highest number that any boot may have taken, so that no number comes twice even where the memory is
 * lost. It runs ahead by as many numbers as there were resets since the memory was lost, up to BOOT_AHEAD_MAX: records are
 * written at the first boot with lost memory, at its 1st, 3rd, 7th, 15th ... reset, and in the end at every 4096th. */
#ifndef BOOT_COUNT_H
#define BOOT_COUNT_H

#include <stdbool.h>
#include <stdint.h>

#include "record.h"

#define BOOT_AHEAD_MAX 4095

/* What the boot before left in memory. */
struct boot_memory {
    uint32_t sequence; /* of the record that it goes with */
    int32_t first;     /* the number of the boot that found the memory lost */
    int32_t count;     /* the number of the newest boot */
    uint32_t check;
};

struct boot {
    int32_t count;    /* the number of this boot; 0: not known */
    int32_t first;    /* as in struct boot_memory */
    int32_t reserved; /* boot_count of the record that has to be in flash memory before `count` is told */
};

/* The boot behind that of `memory`; where that does not go with the newest `record`, the first behind the record. */
struct boot boot_next(const struct boot_memory *memory, const struct record *record);

/* Leave it for the next boot; `sequence` is that of the newest record now. */
void boot_remember(struct boot_memory *memory, const struct boot *boot, uint32_t sequence);

#endif
