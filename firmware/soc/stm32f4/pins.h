/* What a pin is for. The port's clock has to run before. */
#ifndef PINS_H
#define PINS_H

#include <stdbool.h>
#include <stdint.h>

#include "regs.h"

enum pin_mode { PIN_INPUT, PIN_OUTPUT, PIN_ALTERNATE, PIN_ANALOG };
enum pin_pull { PIN_FLOATS, PIN_UP, PIN_DOWN };

/* `function` is the alternate one, 0..15, where the mode says so. */
void pin_set_up(struct gpio *port, uint32_t pin, enum pin_mode mode, enum pin_pull pull, uint32_t function);

void pin_write(struct gpio *port, uint32_t pin, bool high);
/* What is on the pin; what was written to it. */
bool pin_read(const struct gpio *port, uint32_t pin);
bool pin_written(const struct gpio *port, uint32_t pin);

#endif
