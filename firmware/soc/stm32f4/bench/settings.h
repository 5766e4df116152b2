/* What a board is built with, and what its record in flash memory says. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include "amplifier.h"
#include "boot_count.h"
#include "dcmp_device.h"
#include "record.h"

struct settings {
    struct dcmp_config config;
    struct amplifier_scale scale;
    enum record_link link;
    uint32_t baud;
    int32_t failure; /* enum app_failure */
};

/* Read the record; `divides_supply` is the amplifier's (amplifier.h). Without a good one, the settings are weak and their `failure` says so. */
struct settings settings_read(int32_t board, int32_t reset_cause, bool divides_supply);

/* Count this boot: in `memory`, which a reset leaves alone, and where that is not enough in a new record. A record takes up to half
 * a second, once in some two hundred of them. Where it cannot be written the count is 0, and `failure` says so. */
void settings_count_boot(struct settings *settings, struct boot_memory *memory);

#endif
