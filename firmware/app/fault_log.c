#include "fault_log.h"

#include <stddef.h>

#include "dcmp_crc.h"

#define MAGIC 0x10600000u /* what memory that was never written is not, with a CRC-16 that fits */

static uint32_t check(const struct fault_log *log)
{
    return MAGIC | dcmp_crc16((const uint8_t *)log, offsetof(struct fault_log, crc));
}

void fault_log_open(struct fault_log *log)
{
    if (log->crc != check(log)) {
        static const struct fault_log empty;
        *log = empty;
        log->crc = check(log);
    }
}

void fault_log_add(struct fault_log *log, const struct fault_log_entry *entry)
{
    log->entries[log->written % FAULT_LOG_ENTRIES] = *entry;
    log->written++;
    log->crc = check(log);
}

const struct fault_log_entry *fault_log_look(const struct fault_log *log, uint32_t back)
{
    if (back >= FAULT_LOG_ENTRIES || back >= log->written) {
        return NULL;
    }
    return &log->entries[(log->written - 1u - back) % FAULT_LOG_ENTRIES];
}
