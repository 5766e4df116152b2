#include "settings.h"

#include "app.h"
#include "nvm.h"

#define PLACES (NVM_SECTOR_BYTES / (RECORD_WORDS * sizeof(uint32_t)))
#define VERSION 0x0001u
#define PERIOD_MIN_US 100
#define PERIOD_MAX_US 10000
#define BAUD_MIN 9600u
#define BAUD_MAX 2000000u
#define CODE_MAX 4095

/* Of a board that nobody has told anything: weak, and in FAULT until somebody clears it. */
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

static struct settings from_record(const struct record *record, int32_t reset_cause)
{
    const struct settings settings = {
        .config =
            {
                .board = BOARD_NUMBER,
                .boot_count = record->boot_count,
                .reset_cause = reset_cause,
                .counts_per_rev = record->counts_per_rev,
                .period_us = record->period_us,
                .voltage_limit_mV = record->voltage_limit_mV,
                .slew_mV_per_ms = record->slew_mV_per_ms,
                .watchdog_ms = record->watchdog_ms,
                .speed_limit_counts_s = record->speed_limit_counts_s,
                .travel_limit_counts = record->travel_limit_counts,
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

/* The same record with one boot more, behind the newest. */
static bool count_boot(const struct record *const sectors[RECORD_SECTORS], const struct record *newest)
{
    const struct record_place place = record_next(sectors, PLACES, newest);
    struct record next = *newest;
    next.sequence++;
    next.boot_count++;
    record_seal(&next);
    return (!place.blank_first || nvm_erase(place.sector)) &&
           nvm_write(place.sector, place.index * sizeof(struct record), (const uint32_t *)&next, RECORD_WORDS);
}

struct settings settings_load(int32_t reset_cause)
{
    const struct record *const sectors[RECORD_SECTORS] = {nvm_sector(0u), nvm_sector(1u)};
    const struct record *found = record_newest(sectors, PLACES);
    const struct record *record = found != 0 && is_possible(found) ? found : &unknown;
    struct settings settings = from_record(record, reset_cause);
    if (record == found && !dcmp_config_valid(&settings.config)) {
        record = &unknown;
        settings = from_record(record, reset_cause);
    }
    if (record == &unknown) {
        settings.failure = found == 0 ? APP_NO_RECORD : APP_BAD_RECORD;
    } else {
        settings.config.boot_count++;
        settings.failure = count_boot(sectors, found) ? APP_WELL : APP_NO_MEMORY;
    }
    return settings;
}
