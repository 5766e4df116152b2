#include "app.h"

#include <stddef.h>

#define CHUNK 64u /* bytes at a time */
#define LATE_MAX 255u

/* What the log has of earlier boots can be asked for over the wire. */
static struct dcmp_config with_last_fault(const struct dcmp_config *config, const struct fault_log *log)
{
    struct dcmp_config full = *config;
    const struct fault_log_entry *newest = fault_log_look(log, 0u);
    if (newest != NULL) {
        full.last_fault = (int32_t)newest->code;
        full.last_fault_detail = newest->detail;
    }
    return full;
}

void app_start(struct app *app, const struct dcmp_config *config, enum dcmp_carrier carrier, struct fault_log *log,
               int32_t failure, uint32_t now_us)
{
    fault_log_open(log);
    const struct dcmp_config full = with_last_fault(config, log);
    (void)dcmp_device_init(&app->device, &full, now_us);
    dcmp_port_init(&app->port, carrier);
    app->log = log;
    app->boot_count = config->boot_count;
    app->failure = failure;
}

static bool is_faulted(const struct app *app)
{
    return app->device.supervisor.state == DCMP_FAULTED;
}

static void remember_fault(struct app *app)
{
    const struct dcmp_fault *fault = &app->device.supervisor.fault;
    if (is_faulted(app) && !app->faulted) {
        const struct fault_log_entry entry = {app->boot_count, app->device.tick, fault->code, fault->detail};
        fault_log_add(app->log, &entry);
    }
    app->faulted = is_faulted(app);
}

struct dcmp_output app_settle(struct app *app, uint32_t now_us)
{
    const struct dcmp_output output = dcmp_device_output(&app->device, now_us);
    remember_fault(app);
    return output;
}

struct dcmp_output app_fail(struct app *app, enum dcmp_fault_code code, int32_t detail, uint32_t now_us)
{
    dcmp_device_fail(&app->device, code, detail, now_us);
    return app_settle(app, now_us);
}

/* What was wrong before there was a device that could say so. */
static void say_failure(struct app *app, uint32_t now_us)
{
    if (app->failure != APP_WELL) {
        dcmp_device_fail(&app->device, DCMP_INTERNAL, app->failure, now_us);
        app->failure = APP_WELL;
    }
}

uint32_t app_missed(uint32_t between_us, uint32_t period_us)
{
    const uint32_t periods = between_us / period_us + (between_us % period_us > period_us / 2u ? 1u : 0u);
    return periods > 1u ? periods - 1u : 0u;
}

/* Those that were missed count as well, up to where the counter stops. */
static void count_late(struct app *app, const struct app_tick *tick)
{
    for (uint32_t i = 0; i < tick->missed && i < LATE_MAX; i++) {
        dcmp_device_late_tick(&app->device);
    }
    if (tick->late) {
        dcmp_device_late_tick(&app->device);
    }
}

struct dcmp_output app_tick(struct app *app, const struct app_tick *tick)
{
    count_late(app, tick);
    if (app->lost) {
        app->lost = false;
        dcmp_device_overrun(&app->device);
    }
    dcmp_device_idle(&app->device, app->idle_percent);
    (void)dcmp_device_tick(&app->device, tick->now_us, tick->counts, &tick->edge);
    say_failure(app, tick->now_us);
    app->life.decisions = app->device.tick;
    return app_settle(app, tick->now_us);
}

uint8_t app_frame_end(const struct app *app)
{
    return app->port.carrier == DCMP_CARRIER_COBS ? 0u : (uint8_t)'\r';
}

/* Whether a frame has ended in these bytes, good or bad. */
static bool has_frame(struct app *app, const uint8_t *bytes, size_t length)
{
    bool ended = false;
    const uint8_t end = app_frame_end(app);
    for (size_t i = 0; i < length; i++) {
        if (bytes[i] != end) {
            app->inside = true;
        } else if (app->inside) {
            app->inside = false;
            ended = true;
        } else {
            /* an end behind an end */
        }
    }
    return ended;
}

struct dcmp_output app_serve_bytes(struct app *app, uint32_t now_us)
{
    uint8_t bytes[CHUNK];
    uint8_t replies[CHUNK];
    const size_t length = ring_take(&app->received, bytes, sizeof bytes);
    const size_t replied =
        dcmp_port_receive(&app->port, &app->device, bytes, length, now_us, replies, sizeof replies);
    if (!ring_put(&app->sending, replies, replied)) {
        dcmp_device_overrun(&app->device);
    }
    if (has_frame(app, bytes, length) && !dcmp_device_waits(&app->device)) {
        app->answers++;
    }
    app->life.receptions++;
    app_say(app);
    return app_settle(app, now_us);
}

void app_say(struct app *app)
{
    uint8_t bytes[4u * CHUNK];
    const size_t room = ring_room(&app->sending);
    const size_t length =
        dcmp_port_transmit(&app->port, &app->device, bytes, room < sizeof bytes ? room : sizeof bytes);
    (void)ring_put(&app->sending, bytes, length); /* there is room */
}
