#include "timebase.h"

#include "clock.h"
#include "regs.h"

#define US_HZ 1000000u

static void set_up(struct timer *timer, uint32_t timers_Hz, uint32_t last)
{
    timer->PSC = timers_Hz / US_HZ - 1u;
    timer->ARR = last;
    timer->CR1 = TIM_CR1_URS;
    timer->EGR = TIM_EGR_UG; /* the prescaler counts from here on */
    timer->SR = 0;
}

void timebase_start(uint32_t timers_Hz)
{
    clock_enable(&RCC->APB1ENR, RCC_APB1ENR_TIM5EN);
    set_up(TIM5, timers_Hz, UINT32_MAX);
    TIM5->CR1 = TIM_CR1_URS | TIM_CR1_CEN;
}

uint32_t timebase_us(void)
{
    return TIM5->CNT;
}

void timebase_start_ticks(uint32_t timers_Hz, uint32_t period_us)
{
    clock_enable(&RCC->APB1ENR, RCC_APB1ENR_TIM3EN);
    set_up(TIM3, timers_Hz, period_us - 1u);
    TIM3->CR2 = TIM_CR2_MMS_UPDATE << TIM_CR2_MMS_POS;
    TIM3->DIER = TIM_DIER_UIE;
    TIM3->CR1 = TIM_CR1_URS | TIM_CR1_CEN;
}

uint32_t timebase_take_tick(void)
{
    TIM3->SR = TIM_SR_ALL & ~TIM_SR_UIF;
    return TIM3->CNT;
}

bool timebase_tick_due(void)
{
    return (TIM3->SR & TIM_SR_UIF) != 0u;
}
