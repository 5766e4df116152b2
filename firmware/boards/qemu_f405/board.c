/* The same chip in an emulator that knows its processor, its memory and its UARTs, but no encoder and no amplifier: host on
 * USART 1, plant port (boards/native/plant_port.h) on USART 2. Start-up, vectors, interrupts, rings and core are those of the
 * bench board; time and ticks are the plant's. */
#include "amplifier_enable.h"
#include "app.h"
#include "board.h"
#include "clock.h"
#include "handlers.h"
#include "interrupts.h"
#include "link_irq.h"
#include "plant_port.h"
#include "reset.h"
#include "settings.h"
#include "startup.h"
#include "usart.h"

#define BAUD 1000000u
#define MS_OF_CLOCK 168000u /* the emulator's, for any value of its registers */

struct board {
    struct app app;
    struct settings settings;
    struct ring plant_said;
    struct ring plant_told;
    struct plant_tick tick;
    struct dcmp_output output;
    uint32_t since_us;
    volatile bool changed; /* the output, since the plant was told */
};

static struct board board;
static struct fault_log fault_log __attribute__((section(".noinit")));

static void apply(struct dcmp_output output)
{
    if (output.voltage_mV != board.output.voltage_mV || output.enable != board.output.enable) {
        board.output = output;
        board.since_us = board.tick.now_us;
        board.changed = true;
    }
}

/* ------------------------------------------------------------------------------------- interrupts */

void board_serial(void)
{
    const struct usart_event event = usart_serve(USART1, &board.app.received, &board.app.sending);
    if (event.lost) {
        board.app.lost = true;
    }
    if (event.received && event.byte == app_frame_end(&board.app)) {
        interrupt_pend(LINK_IRQ);
    }
}

void board_plant(void)
{
    (void)usart_serve(USART2, &board.plant_said, &board.plant_told);
}

void board_link(void)
{
    apply(app_serve_bytes(&board.app, board.tick.now_us));
}

/* Pended by the main loop when the plant says that it is time. */
void board_tick(void)
{
    const struct app_tick tick = {.now_us = board.tick.now_us, .counts = board.tick.counts};
    board.app.life.ticks++;
    apply(app_tick(&board.app, &tick));
    app_say(&board.app);
    interrupt_pend(LINK_IRQ);
}

void board_nmi(void)
{
    board_error();
}

void board_error(void)
{
    enable_hold();
    reset_now();
}

/* ------------------------------------------------------------------------------------------ main */

/* The emulator's transmitter is always ready, and never says so by itself. */
static void pump(struct usart *port, struct ring *sending)
{
    uint8_t byte;
    while ((port->SR & USART_SR_TXE) != 0u && ring_take(sending, &byte, 1u) == 1u) {
        port->DR = byte;
    }
}

static void tell_plant(bool unasked)
{
    uint8_t bytes[PLANT_OUTPUT_BYTES];
    interrupts_mask(); /* a change comes after this message, or is in it */
    const struct plant_output output = {
        .now_us = board.tick.now_us,
        .since_us = board.since_us,
        .fed_us = board.app.device.watchdog.fed_us,
        .voltage_mV = board.output.voltage_mV,
        .enable = board.output.enable,
        .state = (uint8_t)board.app.device.supervisor.state,
        .owner = board.app.device.session.owner,
        .fault = board.app.device.supervisor.fault.code,
        .unasked = unasked,
        .link_up = true,
    };
    board.changed = false;
    interrupts_unmask();
    plant_pack_output(&output, bytes);
    (void)ring_put(&board.plant_told, bytes, sizeof bytes);
    pump(USART2, &board.plant_told);
}

/* The emulator's wall clock: until the host has answered, or for so long. */
static void wait_for_host(uint32_t answers, uint32_t wait_ms)
{
    uint32_t ms = 0;
    SYSTICK->VAL = 0;
    while (ms < wait_ms && board.app.answers == answers) {
        pump(USART1, &board.app.sending);
        ms += (SYSTICK->CTRL & SYSTICK_CTRL_COUNTFLAG) != 0u ? 1u : 0u;
    }
}

/* Collect a message of the plant's, which may come in pieces. */
static bool plant_rings(uint8_t bytes[PLANT_TICK_BYTES], size_t *length)
{
    *length += ring_take(&board.plant_said, &bytes[*length], PLANT_TICK_BYTES - *length);
    if (*length < PLANT_TICK_BYTES) {
        return false;
    }
    *length = 0;
    plant_unpack_tick(bytes, &board.tick);
    return true;
}

static void serve_tick(void)
{
    const uint32_t answers = board.app.answers;
    interrupt_pend(BOARD_TICK_IRQ);
    wait_for_host(answers, board.tick.wait_ms);
    pump(USART1, &board.app.sending);
    tell_plant(false);
}

void board_hold(void)
{
    enable_hold();
}

static void start(void)
{
    (void)clock_start(BOARD_CRYSTAL_HZ); /* the emulator has none: the waits end, and that is what is tried here */
    board.settings = settings_read(BOARD_NUMBER, reset_take_cause(), false);
    board.app.failure = board.settings.failure;
    app_start(&board.app, &board.settings.config,
              board.settings.link == RECORD_SLCAN ? DCMP_CARRIER_SLCAN : DCMP_CARRIER_COBS, &fault_log,
              board.settings.failure, 0u);
    clock_enable(&RCC->APB1ENR, RCC_APB1ENR_USART2EN);
    clock_enable(&RCC->APB2ENR, RCC_APB2ENR_USART1EN);
    usart_start(USART1, BAUD, BAUD);
    usart_start(USART2, BAUD, BAUD);
    SYSTICK->LOAD = MS_OF_CLOCK - 1u;
    SYSTICK->CTRL = SYSTICK_CTRL_ENABLE | SYSTICK_CTRL_CLKSOURCE;
    interrupt_enable(USART1_IRQ, INTERRUPTS_BYTES);
    interrupt_enable(USART2_IRQ, INTERRUPTS_BYTES);
    interrupt_enable(LINK_IRQ, INTERRUPTS_CORE);
    interrupt_enable(BOARD_TICK_IRQ, INTERRUPTS_CORE);
}

/* Unless there is something to do already; what comes in between waits, and wakes. */
static void sleep(void)
{
    interrupts_mask();
    if (ring_is_empty(&board.plant_said) && !board.changed) {
        interrupts_wait();
    }
    interrupts_unmask();
}

void board_main(void)
{
    uint8_t bytes[PLANT_TICK_BYTES];
    size_t length = 0;
    start();
    tell_plant(true); /* it may begin */
    for (;;) {
        sleep();
        pump(USART1, &board.app.sending);
        if (plant_rings(bytes, &length)) {
            serve_tick();
        } else if (board.changed) {
            tell_plant(true);
        } else {
            /* nothing to do */
        }
    }
}
