/* The rooms put together: what happens at a tick, and what between two of them. */
#include "dcmp_device.h"

#include "dcmp_device_state.h"
#include "dcmp_guard.h"
#include "dcmp_receive.h"
#include "dcmp_report.h"

#define OLDEST_US 3000u   /* of a SAMPLE that a DRIVE was computed from */
#define REPEAT_US 100000u /* FAULT and HEALTH */

static uint32_t periods(uint32_t us, uint32_t period_us)
{
    return (us + period_us - 1u) / period_us;
}

bool dcmp_device_init(struct dcmp_device *device, const struct dcmp_config *config, uint32_t now_us)
{
    static const struct dcmp_device nothing = {0};
    *device = nothing;
    device->valid = dcmp_config_valid(config);
    if (!device->valid) {
        return false;
    }
    device->node = config->node;
    device->firmware_version = config->firmware_version;
    device->tick = UINT32_MAX; /* the first one is 0 */
    device->oldest = periods(OLDEST_US, (uint32_t)config->period_us);
    device->repeat = periods(REPEAT_US, (uint32_t)config->period_us);
    device->health_in = device->repeat;
    device->link_up = true;
    dcmp_supervisor_init(&device->supervisor);
    dcmp_watchdog_feed(&device->watchdog, now_us, 0, 0);
    dcmp_encoder_init(&device->encoder, config->period_us);
    dcmp_amplifier_cut(&device->amplifier);
    dcmp_health_init(&device->health);
    dcmp_session_end(&device->session);
    dcmp_parameters_init(&device->parameters, config);
    dcmp_transmit_init(&device->transmit);
    return true;
}

void dcmp_device_receive(struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us)
{
    if (!device->valid) {
        return;
    }
    switch (dcmp_check(frame, device->node)) {
    case DCMP_GENUINE:
        dcmp_guard_time(device, now_us); /* a DRIVE that comes too late must not hide that it did */
        dcmp_health_frame(&device->health, false);
        dcmp_receive_message(device, frame, now_us);
        break;
    case DCMP_DAMAGED:
        dcmp_device_corrupt(device, now_us);
        break;
    default:
        break;
    }
}

void dcmp_device_corrupt(struct dcmp_device *device, uint32_t now_us)
{
    if (!device->valid) {
        return;
    }
    dcmp_guard_time(device, now_us);
    dcmp_health_frame(&device->health, true);
    if (dcmp_health_link_corrupt(&device->health)) {
        dcmp_guard_raise(device, DCMP_EVENT_CORRUPTION, DCMP_CORRUPT_LINK, device->health.frames.count);
    }
}

void dcmp_device_overrun(struct dcmp_device *device)
{
    dcmp_health_count(&device->health.report.ring_overruns);
}

void dcmp_device_link(struct dcmp_device *device, bool up, uint32_t now_us)
{
    if (device->link_up && !up) {
        dcmp_health_count(&device->health.report.bus_offs);
        dcmp_transmit_forget_answers(&device->transmit); /* no host waits for them any more */
    }
    device->link_up = up;
    dcmp_guard_time(device, now_us);
}

void dcmp_device_fail(struct dcmp_device *device, enum dcmp_fault_code code, int32_t detail, uint32_t now_us)
{
    dcmp_guard_time(device, now_us); /* what was earlier is the cause */
    dcmp_guard_raise(device, DCMP_EVENT_STOP, code, detail);
}

static struct dcmp_output output(const struct dcmp_device *device)
{
    const struct dcmp_output now = {dcmp_amplifier_voltage(&device->amplifier), device->supervisor.state == DCMP_RUN};
    return now;
}

static bool is_live(const struct dcmp_device *device)
{
    return device->supervisor.state == DCMP_ARMING || device->supervisor.state == DCMP_RUN;
}

static bool missed_drive(struct dcmp_device *device)
{
    const bool missed = !device->driven;
    device->driven = false;
    if (missed && is_live(device)) {
        dcmp_health_count(&device->health.report.sequence_gaps);
    }
    return missed;
}

static void step_amplifier(struct dcmp_device *device)
{
    if (device->supervisor.state == DCMP_RUN) {
        const int32_t *value = device->parameters.value;
        dcmp_amplifier_step(&device->amplifier, value[DCMP_VOLTAGE_LIMIT_MV], value[DCMP_SLEW_MV_PER_MS],
                            value[DCMP_PERIOD_US]);
    }
}

struct dcmp_output dcmp_device_tick(struct dcmp_device *device, uint32_t now_us, uint32_t counts,
                                    const struct dcmp_edge *edge)
{
    if (!device->valid) {
        return output(device);
    }
    const int32_t *value = device->parameters.value;
    const int16_t applied_mV = dcmp_amplifier_voltage(&device->amplifier); /* of the period that ends here */
    device->tick++;
    device->parameters.value[DCMP_TICK] = (int32_t)(device->tick & 0x7FFFFFFFu);
    dcmp_encoder_tick(&device->encoder, counts, device->parameters.built[DCMP_SPEED_LIMIT_COUNTS_S],
                      value[DCMP_PERIOD_US]);
    dcmp_supervisor_event(&device->supervisor, DCMP_EVENT_TICK);
    const bool missed = missed_drive(device);
    dcmp_guard_limits(device);
    dcmp_guard_time(device, now_us);
    step_amplifier(device);
    dcmp_report_tick(device, applied_mV, missed, edge);
    return output(device);
}

struct dcmp_output dcmp_device_output(struct dcmp_device *device, uint32_t now_us)
{
    dcmp_guard_time(device, now_us);
    return output(device);
}

bool dcmp_device_waits(const struct dcmp_device *device)
{
    return is_live(device) && device->session.seq != (device->tick & DCMP_SEQ_MASK);
}

void dcmp_device_late_tick(struct dcmp_device *device)
{
    dcmp_health_count(&device->health.report.late_ticks);
}

void dcmp_device_idle(struct dcmp_device *device, uint8_t percent)
{
    device->health.report.idle_percent = percent < 100u ? percent : 100u;
}

bool dcmp_device_transmit(struct dcmp_device *device, struct dcmp_frame *frame)
{
    struct dcmp_answer answer;
    if (dcmp_transmit_next_report(&device->transmit, frame)) {
        return true;
    }
    if (!dcmp_transmit_next_answer(&device->transmit, &answer)) {
        return false;
    }
    dcmp_report_answer(device, &answer, frame);
    return true;
}
