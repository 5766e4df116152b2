/* An analogue amplifier behind DAC channel 1 and a stage that makes it bipolar. */
#include "amplifier.h"
#include "amplifier_enable.h"
#include "board.h"

#define CODE_MAX 4095
#define HALF 2048

static void write_code(int32_t code)
{
    const int32_t fits = code < 0 ? 0 : (code > CODE_MAX ? CODE_MAX : code);
    DAC->DHR12R1 = (uint32_t)fits;
}

static int32_t rounded(int32_t dividend, int32_t divisor)
{
    return (dividend + (dividend < 0 ? -divisor : divisor) / 2) / divisor;
}

bool amplifier_divides_supply(void)
{
    return false;
}

void amplifier_hold(void)
{
    enable_hold();
}

void amplifier_start(const struct clock *clock, const struct amplifier_scale *scale)
{
    (void)clock;
    clock_enable(&RCC->AHB1ENR, pin_clock(BOARD_DAC));
    clock_enable(&RCC->APB1ENR, RCC_APB1ENR_DACEN);
    pin_set_up(BOARD_DAC, PIN_ANALOG, PIN_FLOATS, 0u);
    write_code(scale->zero_code);
    DAC->CR = DAC_CR_EN1;
}

void amplifier_off(const struct amplifier_scale *scale)
{
    enable_low();
    write_code(scale->zero_code);
}

void amplifier_on(const struct amplifier_scale *scale, int16_t voltage_mV)
{
    write_code(scale->zero_code + rounded((int32_t)voltage_mV * HALF, scale->full_scale_mV));
    enable_high();
}

bool amplifier_broken(void)
{
    return false; /* no such line on this board */
}
