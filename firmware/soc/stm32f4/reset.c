#include "reset.h"

#include "regs.h"

enum { UNKNOWN = 0, POWER = 1, PIN = 2, SOFTWARE = 3, WATCHDOG = 4, BROWN_OUT = 5 };

int32_t reset_take_cause(void)
{
    /* Every cause sets the pin's flag too, and power-on sets brown-out's. */
    static const struct {
        uint32_t flag;
        int32_t cause;
    } causes[] = {
        {RCC_CSR_WDGRSTF, WATCHDOG}, {RCC_CSR_WWDGRSTF, WATCHDOG}, {RCC_CSR_SFTRSTF, SOFTWARE},
        {RCC_CSR_PORRSTF, POWER},    {RCC_CSR_BORRSTF, BROWN_OUT}, {RCC_CSR_PADRSTF, PIN},
    };
    const uint32_t flags = RCC->CSR;
    RCC->CSR |= RCC_CSR_RMVF;
    for (uint32_t i = 0; i < sizeof causes / sizeof causes[0]; i++) {
        if ((flags & causes[i].flag) != 0u) {
            return causes[i].cause;
        }
    }
    return UNKNOWN;
}

void reset_now(void)
{
    SCB->AIRCR = SCB_AIRCR_KEY | SCB_AIRCR_SYSRESETREQ;
    for (;;) { /* it takes a few cycles */
    }
}
