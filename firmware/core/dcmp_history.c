/* A shift register of 100 bits, and the number of ones in it. */
#include "dcmp_history.h"

#define OLDEST_WORD (DCMP_HISTORY_WORDS - 1u)
#define OLDEST_BIT ((DCMP_HISTORY_LENGTH - 1u) % 32u)

void dcmp_history_init(struct dcmp_history *history)
{
    for (uint32_t i = 0; i < DCMP_HISTORY_WORDS; i++) {
        history->words[i] = 0;
    }
    history->count = 0;
}

void dcmp_history_add(struct dcmp_history *history, bool bad)
{
    const uint32_t entering = bad ? 1u : 0u;
    const uint32_t leaving = (history->words[OLDEST_WORD] >> OLDEST_BIT) & 1u;
    for (uint32_t i = OLDEST_WORD; i > 0u; i--) {
        history->words[i] = (history->words[i] << 1) | (history->words[i - 1u] >> 31);
    }
    history->words[0] = (history->words[0] << 1) | entering;
    history->count = (uint8_t)(history->count + entering - leaving);
}
