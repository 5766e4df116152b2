#include "startup.h"

#include <stddef.h>

#include "regs.h"
#include "vectors.h"

#define PAINT 0xC5C5C5C5u
#define IN_USE 32u /* words of the stack that this file itself may be in */

/* Where the linker script says that things are. */
extern uint32_t stack_start[];
extern uint32_t bss_start[];
extern uint32_t bss_end[];

void *memcpy(void *restrict to, const void *restrict from, size_t length);
void *memset(void *to, int value, size_t length);

/* A compiler may call these two for any assignment. */
void *memcpy(void *restrict to, const void *restrict from, size_t length)
{
    uint8_t *out = to;
    const uint8_t *in = from;
    for (size_t i = 0; i < length; i++) {
        out[i] = in[i];
    }
    return to;
}

void *memset(void *to, int value, size_t length)
{
    uint8_t *out = to;
    for (size_t i = 0; i < length; i++) {
        out[i] = (uint8_t)value;
    }
    return to;
}

static size_t words(const uint32_t *from, const uint32_t *to)
{
    return (size_t)(to - from);
}

static void fill(uint32_t *from, size_t count, uint32_t value)
{
    for (size_t i = 0; i < count; i++) {
        from[i] = value;
    }
}

_Noreturn void startup_reset(void)
{
    board_hold();
    SCB->VTOR = (uint32_t)&vectors; /* the program that started this one may have had its own */
    fill(stack_start, words(stack_start, stack_end) - IN_USE, PAINT);
    fill(bss_start, words(bss_start, bss_end), 0u);
    board_main();
    for (;;) { /* it does not return */
    }
}

__attribute__((naked)) void startup_error(void)
{
    __asm volatile("ldr r0, =stack_end\n\tmsr msp, r0\n\tb board_error");
}

uint32_t startup_stack_used(void)
{
    const size_t all = words(stack_start, stack_end);
    size_t untouched = 0;
    while (untouched < all && stack_start[untouched] == PAINT) {
        untouched++;
    }
    return (uint32_t)((all - untouched) * sizeof(uint32_t));
}

uint32_t startup_stack_size(void)
{
    return (uint32_t)(words(stack_start, stack_end) * sizeof(uint32_t));
}
