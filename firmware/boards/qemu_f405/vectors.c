/* Where the processor goes. What is missing here leads to HardFault, and so to an end. */
#include "handlers.h"
#include "link_irq.h"
#include "startup.h"
#include "usart.h"
#include "vectors.h"

const struct vectors vectors __attribute__((section(".vectors"), used)) = {
    .stack = stack_end,
    .reset = startup_reset,
    .exceptions = {board_nmi, startup_error, startup_error, startup_error, startup_error},
    .interrupts =
        {
            [LINK_IRQ] = board_link,
            [BOARD_TICK_IRQ] = board_tick,
            [USART1_IRQ] = board_serial,
            [USART2_IRQ] = board_plant,
        },
};
