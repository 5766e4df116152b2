#include "boot_count.h"

#include <stddef.h>

#include "dcmp_crc.h"

#define MAGIC 0xB0070000u /* what memory that was never written is not, with a CRC-16 that fits */
#define RECORDED_MAX (INT32_MAX - BOOT_AHEAD_MAX - 1)

static uint32_t check(const struct boot_memory *memory)
{
    return MAGIC | dcmp_crc16((const uint8_t *)memory, offsetof(struct boot_memory, check));
}

/* Whether memory was left by the boot before. Other content that has the right checksum and sequence by chance still names a
 * number that the record has reserved: it is too low by BOOT_AHEAD_MAX at most. */
static bool is_kept(const struct boot_memory *memory, const struct record *record)
{
    return memory->check == check(memory) && memory->sequence == record->sequence && memory->first > 0 &&
           memory->first <= memory->count && memory->count <= record->boot_count &&
           record->boot_count - memory->count <= BOOT_AHEAD_MAX;
}

/* How many numbers a record that is written now runs ahead. */
static int32_t ahead(int32_t resets)
{
    return resets < BOOT_AHEAD_MAX ? resets : BOOT_AHEAD_MAX;
}

struct boot boot_next(const struct boot_memory *memory, const struct record *record)
{
    struct boot boot = {0, 0, record->boot_count};
    if (record->boot_count < 0 || record->boot_count > RECORDED_MAX) {
        return boot;
    }
    const bool kept = is_kept(memory, record);
    boot.count = (kept ? memory->count : record->boot_count) + 1;
    boot.first = kept ? memory->first : boot.count;
    if (boot.count > record->boot_count) {
        boot.reserved = boot.count + ahead(boot.count - boot.first);
    }
    return boot;
}

void boot_remember(struct boot_memory *memory, const struct boot *boot, uint32_t sequence)
{
    memory->sequence = sequence;
    memory->first = boot->first;
    memory->count = boot->count;
    memory->check = check(memory);
}
