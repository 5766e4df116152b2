/* The newest faults, in memory that a reset leaves alone: what a board that came back can say of why. Power-on empties it. */
#ifndef FAULT_LOG_H
#define FAULT_LOG_H

#include <stdint.h>

#define FAULT_LOG_ENTRIES 8u

struct fault_log_entry {
    int32_t boot;    /* the boot count it happened in */
    uint32_t tick;   /* periods since that boot */
    uint32_t code;   /* as in FAULT */
    int32_t detail;  /* as in FAULT */
};

struct fault_log {
    uint32_t written; /* entries, ever */
    struct fault_log_entry entries[FAULT_LOG_ENTRIES];
    uint32_t crc;
};

/* Once after a reset: keeps what is whole, otherwise begins anew. */
void fault_log_open(struct fault_log *log);

void fault_log_add(struct fault_log *log, const struct fault_log_entry *entry);

/* The newest is 0; null if there are not so many. */
const struct fault_log_entry *fault_log_look(const struct fault_log *log, uint32_t back);

#endif
