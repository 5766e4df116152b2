#include "pins.h"

static void put(volatile uint32_t *at, uint32_t width, uint32_t place, uint32_t value)
{
    const uint32_t shift = width * place;
    const uint32_t mask = ((1u << width) - 1u) << shift;
    *at = (*at & ~mask) | (value << shift);
}

void pin_set_up(struct gpio *port, uint32_t pin, enum pin_mode mode, enum pin_pull pull, uint32_t function)
{
    put(&port->PUPDR, 2u, pin, (uint32_t)pull);
    if (mode == PIN_ALTERNATE) { /* before the mode, so that no other function is on the pin for a moment */
        put(pin < 8u ? &port->AFRL : &port->AFRH, 4u, pin & 7u, function);
    }
    put(&port->MODER, 2u, pin,
        mode == PIN_OUTPUT ? 1u : (mode == PIN_ALTERNATE ? 2u : (mode == PIN_ANALOG ? 3u : 0u)));
}

void pin_write(struct gpio *port, uint32_t pin, bool high)
{
    port->BSRR = high ? BIT(pin) : BIT(pin + 16u);
}

bool pin_read(const struct gpio *port, uint32_t pin)
{
    return (port->IDR & BIT(pin)) != 0u;
}

bool pin_written(const struct gpio *port, uint32_t pin)
{
    return (port->ODR & BIT(pin)) != 0u;
}
