/* What this board is built with, and what its record in flash memory says. */
#ifndef SETTINGS_H
#define SETTINGS_H

#include "amplifier.h"
#include "dcmp_device.h"
#include "record.h"

struct settings {
    struct dcmp_config config;
    struct amplifier_scale scale;
    enum record_link link;
    uint32_t baud;
    int32_t failure; /* enum app_failure */
};

/* Read the record and count this boot in it. Takes up to half a second, once in some two hundred boots. */
struct settings settings_load(int32_t reset_cause);

#endif
