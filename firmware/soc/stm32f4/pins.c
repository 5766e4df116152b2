#include "pins.h"

static void put(volatile uint32_t *at, uint32_t width, uint32_t place, uint32_t value)
{
    const uint32_t shift = width * place;
    const uint32_t mask = ((1u << width) - 1u) << shift;
    *at = (*at & ~mask) | (value << shift);
}

void port_set_up(struct gpio *port, uint32_t number, enum pin_mode mode, enum pin_pull pull, uint32_t function)
{
    put(&port->PUPDR, 2u, number, (uint32_t)pull);
    if (mode == PIN_ALTERNATE) { /* before the mode, so that no other function is on the pin for a moment */
        put(number < 8u ? &port->AFRL : &port->AFRH, 4u, number & 7u, function);
    }
    put(&port->MODER, 2u, number,
        mode == PIN_OUTPUT ? 1u : (mode == PIN_ALTERNATE ? 2u : (mode == PIN_ANALOG ? 3u : 0u)));
}

void port_write(struct gpio *port, uint32_t number, bool high)
{
    port->BSRR = high ? BIT(number) : BIT(number + 16u);
}

bool port_read(const struct gpio *port, uint32_t number)
{
    return (port->IDR & BIT(number)) != 0u;
}

bool port_written(const struct gpio *port, uint32_t number)
{
    return (port->ODR & BIT(number)) != 0u;
}
