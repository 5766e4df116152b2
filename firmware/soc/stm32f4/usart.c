#include "usart.h"

void usart_start(struct usart *port, uint32_t bus_Hz, uint32_t baud)
{
    port->BRR = (bus_Hz + baud / 2u) / baud;
    port->CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
}

static struct usart_event receive(const struct usart *port, uint32_t status, struct ring *received)
{
    struct usart_event event = {false, (uint8_t)(port->DR & 0xFFu), (status & USART_SR_ORE) != 0u};
    if ((status & USART_SR_RXNE) != 0u) { /* otherwise reading has taken note of the errors, and that was all */
        event.received = ring_put(received, &event.byte, 1u);
        event.lost = event.lost || !event.received;
    }
    return event;
}

static void send(struct usart *port, struct ring *sending)
{
    uint8_t byte;
    if (ring_take(sending, &byte, 1u) == 1u) {
        port->DR = byte;
    } else {
        port->CR1 &= ~USART_CR1_TXEIE;
    }
}

struct usart_event usart_serve(struct usart *port, struct ring *received, struct ring *sending)
{
    const uint32_t status = port->SR;
    struct usart_event event = {false, 0u, false};
    if ((status & (USART_SR_RXNE | USART_SR_ORE | USART_SR_NF | USART_SR_FE)) != 0u) {
        event = receive(port, status, received);
    }
    if ((status & USART_SR_TXE) != 0u && (port->CR1 & USART_CR1_TXEIE) != 0u) {
        send(port, sending);
    }
    return event;
}

void usart_send(struct usart *port)
{
    port->CR1 |= USART_CR1_TXEIE;
}
