/* Which of the last 100 events were bad: exact, one bit each. */
#ifndef DCMP_HISTORY_H
#define DCMP_HISTORY_H

#include <stdbool.h>
#include <stdint.h>

#define DCMP_HISTORY_LENGTH 100u
#define DCMP_HISTORY_WORDS 4u

struct dcmp_history {
    uint32_t words[DCMP_HISTORY_WORDS]; /* bit 0 of word 0 is the newest */
    uint8_t count;                      /* how many of the last 100 are set */
};

void dcmp_history_init(struct dcmp_history *history);
void dcmp_history_add(struct dcmp_history *history, bool bad);

#endif
