/* An H-bridge: TIM1's duty cycle, a direction, and the bridge's own failure line (low), which stops the timer's output
 * without any software. */
#include "amplifier.h"
#include "amplifier_enable.h"
#include "board.h"

#define FREQUENCY_HZ 20000u
#define TIMER 1u /* alternate function */
#define LOCK_MOST 3u /* break, idle states, polarities, modes: until the next reset no program changes them, MOE alone */

static void write_duty(int32_t part, int32_t whole)
{
    const int32_t size = part < 0 ? -part : part;
    const uint32_t period = TIM1->ARR + 1u;
    pin_write(BOARD_DIRECTION, part < 0);
    TIM1->CCR1 = size < whole ? (uint32_t)size * period / (uint32_t)whole : period;
}

bool amplifier_divides_supply(void)
{
    return true;
}

void amplifier_hold(void)
{
    enable_hold();
}

void amplifier_start(const struct clock *clock, const struct amplifier_scale *scale)
{
    (void)scale;
    clock_enable(&RCC->AHB1ENR, pin_clock(BOARD_PWM) | pin_clock(BOARD_DIRECTION) | pin_clock(BOARD_BREAK));
    clock_enable(&RCC->APB2ENR, RCC_APB2ENR_TIM1EN);
    pin_set_up(BOARD_BREAK, PIN_ALTERNATE, PIN_UP, TIMER); /* first: a pin that is not connected is a break */
    pin_set_up(BOARD_DIRECTION, PIN_OUTPUT, PIN_FLOATS, 0u);
    TIM1->ARR = clock->apb2_timers_Hz / FREQUENCY_HZ - 1u;
    TIM1->CCMR1 = (TIM_CCMR1_OC1M_PWM1 << TIM_CCMR1_OC1M_POS) | TIM_CCMR1_OC1PE;
    TIM1->CCER = TIM_CCER_CC1E;
    /* Behind what it locks. No MOE: low until the device is armed. */
    TIM1->BDTR = TIM_BDTR_OSSI | TIM_BDTR_OSSR | TIM_BDTR_BKE | (LOCK_MOST << TIM_BDTR_LOCK_POS);
    TIM1->EGR = TIM_EGR_UG;
    TIM1->SR = 0;
    TIM1->CR1 = TIM_CR1_ARPE | TIM_CR1_CEN;
    pin_set_up(BOARD_PWM, PIN_ALTERNATE, PIN_DOWN, TIMER);
}

void amplifier_off(const struct amplifier_scale *scale)
{
    enable_low();
    TIM1->BDTR &= ~TIM_BDTR_MOE; /* at once; a duty cycle waits for the next period */
    write_duty(0, scale->full_scale_mV);
}

void amplifier_on(const struct amplifier_scale *scale, int16_t voltage_mV)
{
    write_duty(voltage_mV, scale->full_scale_mV);
    if (!pin_written(BOARD_ENABLE)) { /* only when it begins: what stopped the timer stays stopped */
        TIM1->BDTR |= TIM_BDTR_MOE;
        enable_high();
    }
}

bool amplifier_broken(void)
{
    const bool broken = (TIM1->SR & TIM_SR_BIF) != 0u || !pin_read(BOARD_BREAK);
    TIM1->SR = TIM1_SR_ALL & ~TIM_SR_BIF;
    return broken;
}
