#include "usart.h"

void usart_start(struct usart *port, uint32_t bus_Hz, uint32_t baud)
{
    port->BRR = (bus_Hz + baud / 2u) / baud;
    port->CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
}

static bool receive(struct usart *port, uint32_t status, struct ring *received)
{
    const uint8_t byte = (uint8_t)(port->DR & 0xFFu); /* takes note of the errors, too */
    if ((status & USART_SR_RXNE) == 0u) {
        return (status & USART_SR_ORE) == 0u;
    }
    return ring_put(received, &byte, 1u) && (status & USART_SR_ORE) == 0u;
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

bool usart_serve(struct usart *port, struct ring *received, struct ring *sending)
{
    const uint32_t status = port->SR;
    bool whole = true;
    if ((status & (USART_SR_RXNE | USART_SR_ORE | USART_SR_NF | USART_SR_FE)) != 0u) {
        whole = receive(port, status, received);
    }
    if ((status & USART_SR_TXE) != 0u && (port->CR1 & USART_CR1_TXEIE) != 0u) {
        send(port, sending);
    }
    return whole;
}

void usart_send(struct usart *port)
{
    port->CR1 |= USART_CR1_TXEIE;
}
