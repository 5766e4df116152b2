#include "dcmp_receive.h"

#include "dcmp_guard.h"
#include "dcmp_protocol_hash.h"

static void answer(struct dcmp_device *device, const struct dcmp_answer *said)
{
    if (!dcmp_transmit_answer(&device->transmit, said)) {
        dcmp_health_count(&device->health.report.ring_overruns);
    }
}

static void receive_stop(struct dcmp_device *device, const struct dcmp_frame *frame)
{
    struct dcmp_stop stop;
    dcmp_unpack_stop(frame, &stop);
    dcmp_guard_raise(device, DCMP_EVENT_STOP, DCMP_STOPPED, stop.reason);
}

static void accept(struct dcmp_device *device, const struct dcmp_drive *drive, uint32_t now_us)
{
    const bool close = device->session.step <= device->oldest;
    const uint32_t watchdog_ms = (uint32_t)device->parameters.value[DCMP_WATCHDOG_MS];
    device->driven = true;
    dcmp_session_renew(&device->session, now_us);
    dcmp_watchdog_feed(&device->watchdog, now_us, watchdog_ms, drive->ttl_ms);
    dcmp_supervisor_drive(&device->supervisor, drive, close);
    dcmp_amplifier_command(&device->amplifier, drive->voltage_mV);
    dcmp_guard_settle(device); /* outside RUN the command is forgotten again */
    if (drive->release) {
        dcmp_guard_end_session(device);
    }
}

static void receive_drive(struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us)
{
    struct dcmp_drive drive;
    if (device->supervisor.state == DCMP_BOOT) {
        return; /* there is no SAMPLE yet that it could have been computed from */
    }
    dcmp_unpack_drive(frame, &drive);
    switch (dcmp_session_judge(&device->session, &drive, device->tick, device->oldest)) {
    case DCMP_ACCEPTED:
        accept(device, &drive, now_us);
        break;
    case DCMP_GAP:
        dcmp_health_count(&device->health.report.sequence_gaps);
        break;
    default:
        break;
    }
}

static void receive_hello(struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us)
{
    struct dcmp_hello hello;
    struct dcmp_answer identity = {.identity = true};
    struct dcmp_session *session = &device->session;
    dcmp_unpack_hello(frame, &hello);
    identity.mismatch = hello.protocol_hash != DCMP_PROTOCOL_HASH;
    if (!identity.mismatch) {
        if (dcmp_session_ask(session, hello.session, now_us)) {
            device->supervisor.lowered = false; /* a fault is left by an edge of one session */
        } else if (dcmp_session_owns(session, hello.session)) {
            dcmp_session_renew(session, now_us);
        } else {
            /* for another node */
        }
    }
    identity.owned = dcmp_session_owns(session, hello.session);
    identity.busy = session->owner != 0u && !identity.owned;
    answer(device, &identity);
}

static void receive_get(struct dcmp_device *device, const struct dcmp_frame *frame)
{
    struct dcmp_parameter_get get;
    struct dcmp_answer value = {.identity = false};
    dcmp_unpack_parameter_get(frame, &get);
    value.id = get.id;
    value.result = dcmp_parameters_known(get.id) ? DCMP_OK : DCMP_UNKNOWN;
    answer(device, &value);
}

static void receive_set(struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us)
{
    struct dcmp_parameter_set set;
    struct dcmp_answer value = {.identity = false};
    dcmp_unpack_parameter_set(frame, &set);
    const bool owner = dcmp_session_owns(&device->session, set.session);
    const bool idle = device->supervisor.state == DCMP_IDLE;
    if (owner) {
        dcmp_session_renew(&device->session, now_us);
    }
    value.id = set.id;
    value.result = (uint8_t)dcmp_parameters_set(&device->parameters, set.id, set.value, idle, owner);
    answer(device, &value);
}

void dcmp_receive_message(struct dcmp_device *device, const struct dcmp_frame *frame, uint32_t now_us)
{
    switch (frame->id & 0x7F0u) {
    case DCMP_STOP:
        receive_stop(device, frame);
        break;
    case DCMP_DRIVE:
        receive_drive(device, frame, now_us);
        break;
    case DCMP_HELLO:
        receive_hello(device, frame, now_us);
        break;
    case DCMP_PARAMETER_GET:
        receive_get(device, frame);
        break;
    default: /* of what a host sends, PARAMETER_SET is left */
        receive_set(device, frame, now_us);
        break;
    }
}
