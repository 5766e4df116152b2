/* The program of a board with an STM32F405, an encoder, an amplifier, and a host on USART 1 or CAN 1; board.h has the
 * pins.
 *
 * The tick, the link and CAN's interrupts share one priority, so that nothing interrupts the core; only the byte port's is
 * above it. The main loop sleeps, and feeds the watchdog. */
#include "amplifier.h"
#include "app.h"
#include "board.h"
#include "bxcan.h"
#include "clock.h"
#include "handlers.h"
#include "interrupts.h"
#include "link_irq.h"
#include "pins.h"
#include "quadrature.h"
#include "reset.h"
#include "settings.h"
#include "startup.h"
#include "timebase.h"
#include "usart.h"
#include "watchdog.h"

#define LATE_PART 10u /* a tick that is served later than a tenth of a period is late */
#define IDLE_OVER_US 100000u
#define SERIAL_FUNCTION 7u

struct board {
    struct app app;
    struct clock clock;
    struct settings settings;
    uint32_t rang_us; /* when the sample clock rang for the tick before */
};

static struct board board;
static struct fault_log fault_log __attribute__((section(".noinit")));

static void apply(struct dcmp_output output)
{
    if (output.enable) {
        amplifier_on(&board.settings.scale, output.voltage_mV);
    } else {
        amplifier_off(&board.settings.scale);
    }
}

/* ------------------------------------------------------------------------------------------- link */

static bool on_can(void)
{
    return board.settings.link == RECORD_CAN;
}

static void send_frames(void)
{
    struct dcmp_frame frame;
    while (bxcan_has_room() && dcmp_device_transmit(&board.app.device, &frame)) {
        bxcan_send(&frame);
    }
}

/* What is ready to go out. */
static void send(void)
{
    if (on_can()) {
        send_frames();
    } else {
        app_say(&board.app);
        if (!ring_is_empty(&board.app.sending)) {
            usart_send(USART1);
        }
    }
}

static void receive_frames(void)
{
    struct dcmp_frame frame;
    bool lost = false;
    for (uint32_t i = 0; i < BXCAN_FIFO && bxcan_receive(&frame, &lost); i++) {
        dcmp_device_receive(&board.app.device, &frame, timebase_us());
    }
    if (lost) {
        dcmp_device_overrun(&board.app.device);
    }
}

static void look_at_bus(void)
{
    dcmp_device_link(&board.app.device, bxcan_is_on_bus(), timebase_us());
}

void board_link(void)
{
    if (on_can()) {
        receive_frames();
        board.app.life.receptions++;
        apply(app_settle(&board.app, timebase_us()));
    } else {
        apply(app_serve_bytes(&board.app, timebase_us()));
    }
    send();
}

void board_serial(void)
{
    const struct usart_event event = usart_serve(USART1, &board.app.received, &board.app.sending);
    if (event.lost) {
        board.app.lost = true;
    }
    if (event.received && event.byte == app_frame_end(&board.app)) { /* what is less than a frame waits for the tick */
        interrupt_pend(LINK_IRQ);
    }
}

void board_can_received(void)
{
    board_link();
}

void board_can_sent(void)
{
    bxcan_sent();
    send();
}

void board_can_error(void)
{
    look_at_bus();
    apply(app_settle(&board.app, timebase_us()));
}

/* ------------------------------------------------------------------------------------------- tick */

/* What CAN has to do at a tick: what could not be sent in a whole period is out of date. */
static void renew_bus(void)
{
    if (!bxcan_abandon()) {
        dcmp_device_overrun(&board.app.device);
    }
    look_at_bus();
}

void board_tick(void)
{
    const uint32_t late_us = timebase_take_tick();
    const uint32_t now_us = timebase_us();
    const uint32_t rang_us = now_us - late_us;
    const uint32_t period_us = (uint32_t)board.settings.config.period_us;
    const struct app_tick tick = {
        .now_us = now_us,
        .counts = quadrature_latched(),
        .edge = quadrature_edge(rang_us),
        .late = late_us > period_us / LATE_PART,
        .missed = app_missed(rang_us - board.rang_us, period_us),
    };
    board.rang_us = rang_us;
    board.app.life.ticks++;
    if (on_can()) {
        renew_bus();
    }
    apply(app_tick(&board.app, &tick));
    if (amplifier_broken()) {
        apply(app_fail(&board.app, DCMP_BREAK_INPUT, 0, now_us));
    }
    send();
    interrupt_pend(LINK_IRQ);
}

/* ------------------------------------------------------------------------------------------ errors */

static void give_up(int32_t detail)
{
    const struct fault_log_entry entry = {board.app.boot_count, board.app.device.tick, DCMP_INTERNAL, detail};
    amplifier_hold();
    fault_log_add(&fault_log, &entry);
    reset_now();
}

void board_nmi(void)
{
    give_up(clock_crystal_stopped() ? APP_CRYSTAL_STOPPED : APP_CRASHED);
}

void board_error(void)
{
    give_up(APP_CRASHED);
}

/* ------------------------------------------------------------------------------------------- start */

void board_hold(void)
{
    amplifier_hold();
}

static void start_serial(void)
{
    clock_enable(&RCC->AHB1ENR, pin_clock(BOARD_SERIAL_TX) | pin_clock(BOARD_SERIAL_RX));
    clock_enable(&RCC->APB2ENR, RCC_APB2ENR_USART1EN);
    usart_start(USART1, board.clock.apb2_Hz, board.settings.baud);
    pin_set_up(BOARD_SERIAL_TX, PIN_ALTERNATE, PIN_FLOATS, SERIAL_FUNCTION);
    pin_set_up(BOARD_SERIAL_RX, PIN_ALTERNATE, PIN_UP, SERIAL_FUNCTION);
}

static void start_can(void)
{
    static const uint16_t heard[] = DCMP_FROM_HOST;
    uint16_t ids[sizeof heard / sizeof heard[0]];
    for (uint32_t i = 0; i < sizeof heard / sizeof heard[0]; i++) {
        ids[i] = (uint16_t)(heard[i] | board.settings.config.node);
    }
    if (!bxcan_start(board.clock.apb1_Hz, ids, sizeof ids / sizeof ids[0])) {
        board.settings.failure |= APP_NO_LINK;
    }
}

static void start_link(void)
{
    if (on_can()) {
        start_can();
    } else {
        start_serial();
    }
}

static void let_interrupts_come(void)
{
    if (on_can()) {
        interrupt_enable(BXCAN_TX_IRQ, INTERRUPTS_CORE);
        interrupt_enable(BXCAN_RX0_IRQ, INTERRUPTS_CORE);
        interrupt_enable(BXCAN_SCE_IRQ, INTERRUPTS_CORE);
    } else {
        interrupt_enable(USART1_IRQ, INTERRUPTS_BYTES);
    }
    interrupt_enable(LINK_IRQ, INTERRUPTS_CORE);
    interrupt_enable(TIMEBASE_TICK_IRQ, INTERRUPTS_CORE);
}

static void start(void)
{
    static struct boot_memory boot_memory __attribute__((section(".noinit")));
    board.clock = clock_start(BOARD_CRYSTAL_HZ);
    timebase_start(board.clock.apb1_timers_Hz);
    board.settings = settings_read(BOARD_NUMBER, reset_take_cause(), amplifier_divides_supply());
    settings_count_boot(&board.settings, &boot_memory);
    if (board.clock.source != CLOCK_CRYSTAL) {
        board.settings.failure |= APP_NO_CRYSTAL;
    }
    amplifier_start(&board.clock, &board.settings.scale);
    quadrature_start();
    start_link();
    app_start(&board.app, &board.settings.config,
              board.settings.link == RECORD_SLCAN ? DCMP_CARRIER_SLCAN : DCMP_CARRIER_COBS, &fault_log,
              board.settings.failure, timebase_us());
    watchdog_start();
    board.rang_us = timebase_us();
    let_interrupts_come();
    timebase_start_ticks(board.clock.apb1_timers_Hz, (uint32_t)board.settings.config.period_us);
}

/* Sleep until there is something to do; how long that was, us. Interrupts wait for the second look at the clock, so that
 * their work does not count as sleep. */
static uint32_t sleep_us(void)
{
    interrupts_mask();
    const uint32_t from_us = timebase_us();
    interrupts_wait();
    const uint32_t slept_us = timebase_us() - from_us;
    interrupts_unmask();
    return slept_us;
}

void board_main(void)
{
    struct life seen = {0};
    uint32_t idle_us = 0;
    start();
    uint32_t since_us = timebase_us();
    for (;;) {
        idle_us += sleep_us();
        if (life_goes_on(&board.app.life, &seen)) {
            watchdog_feed();
        }
        const uint32_t all_us = timebase_us() - since_us;
        if (all_us >= IDLE_OVER_US) {
            board.app.idle_percent = (uint8_t)(100u * idle_us / all_us);
            since_us += all_us;
            idle_us = 0;
        }
    }
}
