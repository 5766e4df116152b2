#include "watchdog.h"

#include "regs.h"

/* Its oscillator runs at 17 to 47 kHz, divided by 4: 40 ms where it is slowest, 14 ms where it is fastest. The main
 * loop feeds it at every tick. */
#define COUNTS 170u
#define BY_4 0u
#define MANY 100000u /* looks, at 5 periods of that oscillator */

static void wait_while(uint32_t mask)
{
    for (uint32_t looks = 0; looks < MANY && (IWDG->SR & mask) != 0u; looks++) {
    }
}

void watchdog_start(void)
{
    IWDG->KR = IWDG_KEY_START; /* starts the oscillator, without which nothing below is ever done */
    IWDG->KR = IWDG_KEY_WRITE;
    wait_while(IWDG_SR_PVU);
    IWDG->PR = BY_4;
    wait_while(IWDG_SR_RVU);
    IWDG->RLR = COUNTS - 1u;
    wait_while(IWDG_SR_PVU | IWDG_SR_RVU);
    IWDG->KR = IWDG_KEY_FEED;
}

void watchdog_feed(void)
{
    IWDG->KR = IWDG_KEY_FEED;
}
