/* What a pin is for. The port's clock has to run before: `clock_enable(&RCC->AHB1ENR, pin_clock(pin))`. */
#ifndef PINS_H
#define PINS_H

#include <stdbool.h>
#include <stdint.h>

#include "regs.h"

enum pin_mode { PIN_INPUT, PIN_OUTPUT, PIN_ALTERNATE, PIN_ANALOG };
enum pin_pull { PIN_FLOATS, PIN_UP, PIN_DOWN };

/* A pin: 16 times its port, and its number there. */
enum pin {
    PA0, PA1, PA2, PA3, PA4, PA5, PA6, PA7, PA8, PA9, PA10, PA11, PA12, PA13, PA14, PA15,
    PB0, PB1, PB2, PB3, PB4, PB5, PB6, PB7, PB8, PB9, PB10, PB11, PB12, PB13, PB14, PB15,
    PC0, PC1, PC2, PC3, PC4, PC5, PC6, PC7, PC8, PC9, PC10, PC11, PC12, PC13, PC14, PC15,
    PD0, PD1, PD2, PD3, PD4, PD5, PD6, PD7, PD8, PD9, PD10, PD11, PD12, PD13, PD14, PD15,
    PE0, PE1, PE2, PE3, PE4, PE5, PE6, PE7, PE8, PE9, PE10, PE11, PE12, PE13, PE14, PE15,
    PF0, PF1, PF2, PF3, PF4, PF5, PF6, PF7, PF8, PF9, PF10, PF11, PF12, PF13, PF14, PF15,
    PG0, PG1, PG2, PG3, PG4, PG5, PG6, PG7, PG8, PG9, PG10, PG11, PG12, PG13, PG14, PG15,
};

static inline struct gpio *pin_port(enum pin pin)
{
    switch ((uint32_t)pin / 16u) {
    case 0u:
        return GPIOA;
    case 1u:
        return GPIOB;
    case 2u:
        return GPIOC;
    case 3u:
        return GPIOD;
    case 4u:
        return GPIOE;
    case 5u:
        return GPIOF;
    default:
        return GPIOG;
    }
}

static inline uint32_t pin_number(enum pin pin)
{
    return (uint32_t)pin % 16u;
}

/* The bit of its port in RCC's AHB1ENR. */
static inline uint32_t pin_clock(enum pin pin)
{
    return RCC_AHB1ENR_GPIOAEN << ((uint32_t)pin / 16u);
}

void port_set_up(struct gpio *port, uint32_t number, enum pin_mode mode, enum pin_pull pull, uint32_t function);
void port_write(struct gpio *port, uint32_t number, bool high);
bool port_read(const struct gpio *port, uint32_t number);
bool port_written(const struct gpio *port, uint32_t number);

/* `function` is the alternate one, 0..15, where the mode says so. */
static inline void pin_set_up(enum pin pin, enum pin_mode mode, enum pin_pull pull, uint32_t function)
{
    port_set_up(pin_port(pin), pin_number(pin), mode, pull, function);
}

static inline void pin_write(enum pin pin, bool high)
{
    port_write(pin_port(pin), pin_number(pin), high);
}

/* What is on the pin; what was written to it. */
static inline bool pin_read(enum pin pin)
{
    return port_read(pin_port(pin), pin_number(pin));
}

static inline bool pin_written(enum pin pin)
{
    return port_written(pin_port(pin), pin_number(pin));
}

#endif
