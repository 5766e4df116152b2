#include "record.h"

#include <stddef.h>

#include "dcmp_crc.h"

#define MAGIC 0x504D4344u /* DCMP */
#define CHECKED_WORDS (RECORD_WORDS - 1u)
#define BLANK 0xFFFFFFFFu

static uint32_t check(const struct record *record)
{
    return dcmp_crc16((const uint8_t *)record, CHECKED_WORDS * sizeof(uint32_t));
}

static bool is_whole(const struct record *record)
{
    return record->magic == MAGIC && record->crc == check(record);
}

static bool is_blank(const struct record *record)
{
    const uint32_t *words = (const uint32_t *)record;
    bool blank = true;
    for (uint32_t i = 0; i < RECORD_WORDS; i++) {
        blank = blank && words[i] == BLANK;
    }
    return blank;
}

const struct record *record_newest(const struct record *const sectors[RECORD_SECTORS], uint32_t count)
{
    const struct record *newest = NULL;
    for (uint32_t sector = 0; sector < RECORD_SECTORS; sector++) {
        for (uint32_t i = count; i > 0u; i--) { /* the newest come first then, and few checksums are taken */
            const struct record *record = &sectors[sector][i - 1u];
            if ((newest == NULL || record->sequence > newest->sequence) && is_whole(record)) {
                newest = record;
            }
        }
    }
    return newest;
}

static bool is_in(const struct record *record, const struct record *sector, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        if (record == &sector[i]) {
            return true;
        }
    }
    return false;
}

struct record_place record_next(const struct record *const sectors[RECORD_SECTORS], uint32_t count,
                                const struct record *newest)
{
    const uint32_t sector = newest != NULL && is_in(newest, sectors[1], count) ? 1u : 0u;
    uint32_t place = count;
    while (place > 0u && is_blank(&sectors[sector][place - 1u])) {
        place--;
    }
    if (place < count) {
        const struct record_place here = {sector, place, false};
        return here;
    }
    const struct record_place other = {newest != NULL ? 1u - sector : 0u, 0u, true};
    return other;
}

void record_seal(struct record *record)
{
    record->magic = MAGIC;
    record->crc = check(record);
}
