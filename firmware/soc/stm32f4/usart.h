/* A serial port, 8N1, by interrupt: bytes go from and to rings. */
#ifndef USART_H
#define USART_H

#include <stdbool.h>
#include <stdint.h>

#include "regs.h"
#include "ring.h"

#define USART1_IRQ 37u
#define USART2_IRQ 38u

/* `bus_Hz` is of the bus that it hangs on. Its clock and pins are the board's business. */
void usart_start(struct usart *port, uint32_t bus_Hz, uint32_t baud);

/* What an interrupt brought. */
struct usart_event {
    bool received;
    uint8_t byte;
    bool lost; /* bytes: they came faster than they were read, or there was no room */
};

/* In its interrupt. */
struct usart_event usart_serve(struct usart *port, struct ring *received, struct ring *sending);

/* There is something in `sending`. */
void usart_send(struct usart *port);

#endif
