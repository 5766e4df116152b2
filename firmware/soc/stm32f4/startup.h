/* From reset to main. */
#ifndef STARTUP_H
#define STARTUP_H

#include <stdint.h>

/* The first entry of a board's vectors is the end of the stack, the second this. */
extern uint32_t stack_end[];
_Noreturn void startup_reset(void);

/* The vector of every error: board_error on a fresh stack, for the old one may be what is wrong. */
void startup_error(void);

/* How deep the stack has been, and how deep it may be, bytes. */
uint32_t startup_stack_used(void);
uint32_t startup_stack_size(void);

/* What a board brings. `board_hold` runs before memory is as C expects it: registers only. */
void board_hold(void);
void board_main(void);
void board_error(void);

#endif
