#include "dcmp_report.h"

#include <stddef.h>

#include "dcmp_protocol_hash.h"

#define FAULT_CLASS_OTHER 7u

static void queue(struct dcmp_device *device, enum dcmp_report report, const struct dcmp_frame *frame)
{
    if (dcmp_transmit_report(&device->transmit, report, frame)) {
        dcmp_health_count(&device->health.report.ring_overruns);
    }
}

static void report_fault(struct dcmp_device *device)
{
    struct dcmp_frame frame;
    if (device->supervisor.state != DCMP_FAULTED) {
        dcmp_transmit_withdraw(&device->transmit, DCMP_REPORT_FAULT); /* it is over */
        return;
    }
    if (device->fault_in == 0u) {
        device->fault_in = device->repeat;
        dcmp_pack_fault(&frame, device->node, &device->supervisor.fault);
        queue(device, DCMP_REPORT_FAULT, &frame);
    }
    device->fault_in--;
}

static void report_sample(struct dcmp_device *device, int16_t applied_mV, bool missed)
{
    const uint8_t code = device->supervisor.fault.code;
    struct dcmp_frame frame;
    const struct dcmp_sample sample = {
        .position_counts = device->encoder.raw,
        .voltage_mV = applied_mV,
        .tick = (uint8_t)(device->tick & 0xFFu),
        .state = (uint8_t)device->supervisor.state,
        .missed = missed,
        .limited = device->amplifier.limited,
        .fault_class = code < FAULT_CLASS_OTHER ? code : FAULT_CLASS_OTHER,
    };
    dcmp_pack_sample(&frame, device->node, &sample);
    queue(device, DCMP_REPORT_SAMPLE, &frame);
}

static void report_edge(struct dcmp_device *device, const struct dcmp_edge *edge)
{
    struct dcmp_frame frame;
    dcmp_transmit_withdraw(&device->transmit, DCMP_REPORT_EDGE); /* one belongs to its own SAMPLE */
    if (edge == NULL || !edge->seen || device->parameters.value[DCMP_EDGE_STAMPS] == 0) {
        return;
    }
    const struct dcmp_edge_stamp stamp = {edge->counts, edge->age_us, (uint8_t)(device->tick & 0xFFu),
                                          edge->direction};
    dcmp_pack_edge(&frame, device->node, &stamp);
    queue(device, DCMP_REPORT_EDGE, &frame);
}

static void report_health(struct dcmp_device *device)
{
    struct dcmp_frame frame;
    device->health_in--;
    if (device->health_in == 0u) {
        device->health_in = device->repeat;
        dcmp_pack_health(&frame, device->node, &device->health.report);
        queue(device, DCMP_REPORT_HEALTH, &frame);
    }
}

void dcmp_report_tick(struct dcmp_device *device, int16_t applied_mV, bool missed, const struct dcmp_edge *edge)
{
    report_fault(device);
    report_sample(device, applied_mV, missed);
    report_edge(device, edge);
    report_health(device);
}

void dcmp_report_answer(const struct dcmp_device *device, const struct dcmp_answer *answer, struct dcmp_frame *frame)
{
    if (answer->identity) {
        const struct dcmp_identity identity = {DCMP_PROTOCOL_HASH, device->firmware_version, answer->busy,
                                               answer->owned, answer->mismatch};
        dcmp_pack_identity(frame, device->node, &identity);
    } else {
        const struct dcmp_parameter_value value = {
            answer->id, dcmp_parameters_get(&device->parameters, answer->id), answer->result};
        dcmp_pack_parameter_value(frame, device->node, &value);
    }
}
