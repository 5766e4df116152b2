#include "settings.h"

#include <stddef.h>

#include "app.h"
#include "nvm.h"

#define PLACES (NVM_SECTOR_BYTES / (RECORD_WORDS * sizeof(uint32_t)))
#define VERSION 0x0001u
#define PERIOD_MIN_US 100
#define PERIOD_MAX_US 10000
#define BAUD_MIN 9600u
#define BAUD_MAX 2000000u
#define CODE_MAX 4095
#define SUPPLY_MAX_MV 100000

/* Of a board without a record: weak, and in FAULT until a host clears it. */
static const struct record unknown = {
    .counts_per_rev = 4096,
    .period_us = 1000,
    .voltage_limit_mV = 1000,
    .watchdog_ms = 20,
    .speed_limit_counts_s = 4096,
    .travel_limit_counts = 4096,
    .link = RECORD_COBS,
    .baud = 1000000u,
    .zero_code = 2048,
    .full_scale_mV = 10000,
};

static struct settings from_record(const struct record *record, int32_t board, int32_t reset_cause,
                                   bool divides_supply)
{
    const struct settings settings = {
        .config =
            {
                .board = board,
                .boot_count = record->boot_count,
                .reset_cause = reset_cause,
                .counts_per_rev = record->counts_per_rev,
                .period_us = record->period_us,
                .voltage_limit_mV = record->voltage_limit_mV,
                .slew_mV_per_ms = record->slew_mV_per_ms,
                .watchdog_ms = record->watchdog_ms,
                .speed_limit_counts_s = record->speed_limit_counts_s,
                .travel_limit_counts = record->travel_limit_counts,
                .supply_mV = divides_supply ? record->full_scale_mV : 0,
                .firmware_version = VERSION,
                .node = (uint8_t)record->node,
                .edge_stamps = true,
            },
        .scale = {record->zero_code, record->full_scale_mV},
        .link = (enum record_link)record->link,
        .baud = record->baud,
        .failure = APP_WELL,
    };
    return settings;
}

/* What this board asks for beyond the core. */
static bool is_possible(const struct record *record)
{
    const bool paced = record->period_us >= PERIOD_MIN_US && record->period_us <= PERIOD_MAX_US;
    const bool scaled = record->zero_code >= 0 && record->zero_code <= CODE_MAX && record->full_scale_mV > 0;
    const bool linked =
        record->link <= (uint32_t)RECORD_CAN && record->baud >= BAUD_MIN && record->baud <= BAUD_MAX;
    return paced && scaled && linked && record->voltage_limit_mV <= record->full_scale_mV && record->node <= 15u;
}

static const struct record *newest(void)
{
    const struct record *const sectors[RECORD_SECTORS] = {nvm_sector(0u), nvm_sector(1u)};
    return record_newest(sectors, PLACES);
}

struct settings settings_read(int32_t board, int32_t reset_cause, bool divides_supply)
{
    const struct record *found = newest();
    if (found != NULL && is_possible(found)) {
        const struct settings settings = from_record(found, board, reset_cause, divides_supply);
        if (dcmp_config_valid(&settings.config)) {
            return settings;
        }
    }
    struct record least = unknown;
    if (divides_supply) {
        least.full_scale_mV = SUPPLY_MAX_MV; /* for any supply, the voltage is at most what is asked for */
    }
    struct settings weak = from_record(&least, board, reset_cause, divides_supply);
    weak.failure = found == NULL ? APP_NO_RECORD : APP_BAD_RECORD;
    return weak;
}

/* A record behind the newest. */
static bool append(const struct record *record)
{
    const struct record *const sectors[RECORD_SECTORS] = {nvm_sector(0u), nvm_sector(1u)};
    const struct record_place place = record_next(sectors, PLACES, newest());
    return (!place.blank_first || nvm_erase(place.sector)) &&
           nvm_write(place.sector, place.index * sizeof(struct record), (const uint32_t *)record, RECORD_WORDS);
}

/* Whether a record with this boot count is the newest now. */
static bool reserve(const struct record *record, int32_t boot_count, uint32_t *sequence)
{
    struct record next = *record;
    *sequence = record->sequence;
    if (boot_count == record->boot_count) {
        return true;
    }
    next.sequence++;
    next.boot_count = boot_count;
    record_seal(&next);
    *sequence = next.sequence;
    return append(&next);
}

void settings_count_boot(struct settings *settings, struct boot_memory *memory)
{
    if (settings->failure != APP_WELL) {
        return; /* there is nothing worth writing */
    }
    const struct record *record = newest();
    const struct boot boot = boot_next(memory, record);
    uint32_t sequence;
    settings->config.boot_count = 0;
    if (!reserve(record, boot.reserved, &sequence)) {
        settings->failure = APP_NO_MEMORY;
        return;
    }
    boot_remember(memory, &boot, sequence);
    settings->config.boot_count = boot.count;
}
