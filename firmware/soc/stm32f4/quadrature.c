#include "quadrature.h"

#include "board.h"
#include "clock.h"
#include "pins.h"
#include "regs.h"

#define ENCODER 1u   /* alternate function */
#define FILTER 3u    /* eight samples at the timer's clock: 95 ns */
#define AGE_MAX 65535u

void quadrature_start(void)
{
    clock_enable(&RCC->AHB1ENR, pin_clock(BOARD_ENCODER_A) | pin_clock(BOARD_ENCODER_B));
    clock_enable(&RCC->APB1ENR, RCC_APB1ENR_TIM2EN);
    pin_set_up(BOARD_ENCODER_A, PIN_ALTERNATE, PIN_UP, ENCODER); /* many encoders have open collectors */
    pin_set_up(BOARD_ENCODER_B, PIN_ALTERNATE, PIN_UP, ENCODER);
    TIM2->CCMR1 = (TIM_CCMR_S_OWN << TIM_CCMR1_CC1S_POS) | (FILTER << TIM_CCMR1_IC1F_POS) |
                  (TIM_CCMR_S_OWN << TIM_CCMR1_CC2S_POS) | (FILTER << TIM_CCMR1_IC2F_POS);
    TIM2->CCMR2 = TIM_CCMR_S_TRC << TIM_CCMR2_CC3S_POS;
    TIM2->CCER = TIM_CCER_CC1E | TIM_CCER_CC3E;
    TIM2->SMCR = (TIM_SMCR_SMS_ENCODER << TIM_SMCR_SMS_POS) | (TIM_SMCR_TS_ITR2 << TIM_SMCR_TS_POS);
    TIM2->CR2 = TIM_CR2_MMS_CAPTURE << TIM_CR2_MMS_POS;
    TIM2->ARR = UINT32_MAX;
    TIM2->CR1 = TIM_CR1_CEN;
    TIM5->SMCR = TIM_SMCR_TS_ITR0 << TIM_SMCR_TS_POS;
    TIM5->CCMR1 = TIM_CCMR_S_TRC << TIM_CCMR1_CC1S_POS;
    TIM5->CCER = TIM_CCER_CC1E;
}

uint32_t quadrature_latched(void)
{
    return TIM2->CCR3;
}

struct dcmp_edge quadrature_edge(uint32_t tick_us)
{
    struct dcmp_edge edge = {0};
    if ((TIM2->SR & TIM_SR_CC1IF) == 0u) {
        return edge;
    }
    const uint32_t at_us = TIM5->CCR1;
    edge.counts = TIM2->CCR1; /* takes note of it, too */
    if (TIM5->CCR1 != at_us) { /* another one came in between: it belongs to neither */
        return edge;
    }
    const uint32_t age_us = tick_us - at_us;
    edge.seen = age_us <= (uint32_t)INT32_MAX; /* one after the tick is not of this period */
    edge.age_us = (uint16_t)(age_us < AGE_MAX ? age_us : AGE_MAX);
    edge.direction = (TIM2->CR1 & TIM_CR1_DIR) != 0u ? -1 : 1;
    return edge;
}
