/* The interrupt controller. Everything that calls the core has one priority, so that nothing interrupts it there. */
#ifndef INTERRUPTS_H
#define INTERRUPTS_H

#include <stdint.h>

#include "regs.h"

#define INTERRUPTS_BYTES 0x40u /* above the core: takes single bytes off the wire, and no more */
#define INTERRUPTS_CORE 0x80u

static inline void interrupt_enable(uint32_t irq, uint8_t priority)
{
    NVIC->IPR[irq] = priority;
    NVIC->ISER[irq / 32u] = BIT(irq % 32u);
}

static inline void interrupt_pend(uint32_t irq)
{
    NVIC->ISPR[irq / 32u] = BIT(irq % 32u);
}

static inline void interrupts_mask(void)
{
    __asm volatile("cpsid i" ::: "memory");
}

static inline void interrupts_unmask(void)
{
    __asm volatile("cpsie i" ::: "memory");
}

/* Until an interrupt is pending, masked ones included. */
static inline void interrupts_wait(void)
{
    __asm volatile("dsb\n\twfi" ::: "memory");
}

#endif
