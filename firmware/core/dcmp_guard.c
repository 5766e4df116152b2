#include "dcmp_guard.h"

void dcmp_guard_settle(struct dcmp_device *device)
{
    if (device->supervisor.state == DCMP_RUN) {
        dcmp_encoder_anchor(&device->encoder);
    } else {
        dcmp_amplifier_cut(&device->amplifier);
    }
}

void dcmp_guard_raise(struct dcmp_device *device, enum dcmp_event event, enum dcmp_fault_code code, int32_t detail)
{
    const struct dcmp_fault cause = {(uint8_t)code, (uint8_t)(device->tick & 0xFFu), detail};
    if (dcmp_supervisor_raise(&device->supervisor, event, &cause)) {
        device->fault_in = 0; /* FAULT is due at once */
    }
    dcmp_guard_settle(device);
}

static bool live(const struct dcmp_device *device)
{
    return device->supervisor.state == DCMP_ARMING || device->supervisor.state == DCMP_RUN;
}

void dcmp_guard_end_session(struct dcmp_device *device)
{
    dcmp_session_end(&device->session);
    dcmp_parameters_restore(&device->parameters);
}

void dcmp_guard_time(struct dcmp_device *device, uint32_t now_us)
{
    if (live(device) && dcmp_watchdog_expired(&device->watchdog, now_us)) {
        const uint32_t age = dcmp_watchdog_age(&device->watchdog, now_us);
        dcmp_guard_raise(device, DCMP_EVENT_SILENCE, DCMP_HOST_SILENT, (int32_t)(age & 0x7FFFFFFFu));
    }
    if (!device->link_up) {
        dcmp_guard_raise(device, DCMP_EVENT_LINK_DOWN, DCMP_LINK_DOWN, 0);
    }
    if (!live(device) && dcmp_session_lapsed(&device->session, now_us)) {
        dcmp_guard_end_session(device);
    }
}

static void check_travel(struct dcmp_device *device)
{
    const struct dcmp_encoder *encoder = &device->encoder;
    const int32_t limit = device->parameters.value[DCMP_TRAVEL_LIMIT_COUNTS];
    const int32_t origin = device->parameters.value[DCMP_TRAVEL_ORIGIN_COUNTS];
    int32_t since_arming = limit;
    if (origin != DCMP_FIRST_ARMING) {
        const int32_t distance = dcmp_encoder_distance(encoder, origin);
        if (distance > limit || distance < -limit) {
            dcmp_guard_raise(device, DCMP_EVENT_LIMIT, DCMP_OVER_TRAVEL, distance);
        }
        since_arming = device->parameters.built[DCMP_TRAVEL_LIMIT_COUNTS]; /* not from the session's origin */
    }
    if (dcmp_encoder_too_far(encoder, since_arming)) {
        dcmp_guard_raise(device, DCMP_EVENT_LIMIT, DCMP_OVER_TRAVEL, dcmp_encoder_travel(encoder));
    }
}

void dcmp_guard_limits(struct dcmp_device *device)
{
    const struct dcmp_encoder *encoder = &device->encoder;
    const struct dcmp_speed_limits speed_limits = {device->parameters.built[DCMP_SPEED_LIMIT_COUNTS_S],
                                                   device->parameters.value[DCMP_SPEED_LIMIT_COUNTS_S]};
    if (dcmp_encoder_too_jumpy(encoder)) {
        dcmp_guard_raise(device, DCMP_EVENT_LIMIT, DCMP_ENCODER_JUMP, encoder->jump);
    }
    if (dcmp_encoder_too_fast(encoder, &speed_limits)) {
        dcmp_guard_raise(device, DCMP_EVENT_LIMIT, DCMP_OVER_SPEED, dcmp_encoder_speed(encoder, &speed_limits));
    }
    check_travel(device);
}
