#include "clock.h"

#include "regs.h"

#define INTERNAL_HZ 16000000u
#define PLL_INPUT_HZ 2000000u /* what the manual recommends against jitter */
#define PLL_N 168u
#define PLL_P_2 0u
#define PLL_Q 7u
#define APB1_BY_4 5u
#define APB2_BY_2 4u
#define SYSTEM_PLL 2u
#define LATENCY_168_MHZ 5u
#define MANY 50000u /* looks: 20 ms at 16 MHz, ten times what a crystal takes */

static bool wait_for(const volatile uint32_t *at, uint32_t mask, uint32_t value)
{
    for (uint32_t looks = 0; looks < MANY; looks++) {
        if ((*at & mask) == value) {
            return true;
        }
    }
    return false;
}

static bool start_pll(uint32_t source, uint32_t source_Hz)
{
    RCC->PLLCFGR = ((source_Hz / PLL_INPUT_HZ) << RCC_PLLCFGR_PLLM_POS) | (PLL_N << RCC_PLLCFGR_PLLN_POS) |
                   (PLL_P_2 << RCC_PLLCFGR_PLLP_POS) | source | (PLL_Q << RCC_PLLCFGR_PLLQ_POS) |
                   (RCC->PLLCFGR & BIT(29)); /* a reserved bit that is set after a reset */
    RCC->CR |= RCC_CR_PLLON;
    return wait_for(&RCC->CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY);
}

/* First slower buses and a slower flash, then the faster clock. */
static bool switch_to_pll(void)
{
    FLASH->ACR = (LATENCY_168_MHZ << FLASH_ACR_LATENCY_POS) | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    if (!wait_for(&FLASH->ACR, 7u << FLASH_ACR_LATENCY_POS, LATENCY_168_MHZ << FLASH_ACR_LATENCY_POS)) {
        return false;
    }
    RCC->CFGR = (APB1_BY_4 << RCC_CFGR_PPRE1_POS) | (APB2_BY_2 << RCC_CFGR_PPRE2_POS);
    RCC->CFGR |= SYSTEM_PLL << RCC_CFGR_SW_POS;
    return wait_for(&RCC->CFGR, 3u << RCC_CFGR_SWS_POS, SYSTEM_PLL << RCC_CFGR_SWS_POS);
}

static struct clock fast(enum clock_source source)
{
    const struct clock clock = {source, 168000000u, 42000000u, 84000000u, 84000000u, 168000000u};
    return clock;
}

static struct clock slow(void)
{
    const struct clock clock = {CLOCK_SLOW, INTERNAL_HZ, INTERNAL_HZ, INTERNAL_HZ, INTERNAL_HZ, INTERNAL_HZ};
    RCC->CFGR = 0;
    return clock;
}

struct clock clock_start(uint32_t crystal_Hz)
{
    clock_enable(&RCC->APB1ENR, RCC_APB1ENR_PWREN);
    PWR->CR |= PWR_CR_VOS;
    RCC->CR |= RCC_CR_HSEON;
    if (wait_for(&RCC->CR, RCC_CR_HSERDY, RCC_CR_HSERDY)) {
        if (start_pll(RCC_PLLCFGR_PLLSRC, crystal_Hz) && switch_to_pll()) {
            RCC->CR |= RCC_CR_CSSON;
            return fast(CLOCK_CRYSTAL);
        }
        return slow();
    }
    RCC->CR &= ~RCC_CR_HSEON;
    if (start_pll(0u, INTERNAL_HZ) && switch_to_pll()) {
        return fast(CLOCK_INTERNAL);
    }
    return slow();
}

void clock_enable(volatile uint32_t *enables, uint32_t bit)
{
    *enables |= bit;
    (void)*enables; /* longer than the slowest bus's clock */
    __asm volatile("dsb" ::: "memory");
}

bool clock_crystal_stopped(void)
{
    const bool stopped = (RCC->CIR & RCC_CIR_CSSF) != 0u;
    if (stopped) {
        RCC->CIR |= RCC_CIR_CSSC;
    }
    return stopped;
}
