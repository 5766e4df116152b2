/* The end of a tick, and what the device says. */
#include <stddef.h>

#include "dcmp_protocol_hash.h"
#include "model_inside.h"
#include "wire.h"

static void report(struct model *model, enum model_report kind, struct dcmp_frame *frame)
{
    wire_seal(frame);
    if (model->waiting[kind]) {
        model_count(model, RING_OVERRUNS);
    }
    model->waiting[kind] = true;
    model->reports[kind] = *frame;
}

static void report_fault(struct model *model)
{
    if (model->state != MODEL_FAULT) {
        model->waiting[REPORT_FAULT] = false;
        return;
    }
    if (model->fault_due == 0u) {
        struct dcmp_frame frame = wire_begin(WIRE_FAULT, model->node);
        wire_put(&frame, model->code, 1);
        wire_put(&frame, model->fault_tick, 1);
        wire_put(&frame, (uint32_t)model->detail, 4);
        report(model, REPORT_FAULT, &frame);
        model->fault_due = model_whole_ticks(model, 100000u);
    }
    model->fault_due--;
}

static void report_sample(struct model *model, int64_t applied_uV, bool missed)
{
    struct dcmp_frame frame = wire_begin(WIRE_SAMPLE, model->node);
    wire_put(&frame, model->motion.counts[0], 3);
    wire_put(&frame, (uint32_t)(applied_uV / 1000), 2);
    wire_put(&frame, model->ticks - 1u, 1);
    wire_put(&frame, (uint32_t)model->state + (missed ? 8u : 0u) + (model->limited ? 16u : 0u) +
                         32u * (model->code < 7u ? model->code : 7u), 1);
    report(model, REPORT_SAMPLE, &frame);
}

static void report_edge(struct model *model, const struct dcmp_edge *edge)
{
    model->waiting[REPORT_EDGE] = false;
    if (edge != NULL && edge->seen && model->value[DCMP_EDGE_STAMPS] != 0) {
        struct dcmp_frame frame = wire_begin(WIRE_EDGE, model->node);
        wire_put(&frame, edge->counts, 3);
        wire_put(&frame, edge->age_us, 2);
        wire_put(&frame, model->ticks - 1u, 1);
        wire_put(&frame, (uint8_t)edge->direction, 1);
        report(model, REPORT_EDGE, &frame);
    }
}

static void report_health(struct model *model)
{
    if (--model->health_due == 0u) {
        struct dcmp_frame frame = wire_begin(WIRE_HEALTH, model->node);
        for (uint32_t i = 0; i < (uint32_t)COUNTERS; i++) {
            wire_put(&frame, model->counters[i], 1);
        }
        report(model, REPORT_HEALTH, &frame);
        model->health_due = model_whole_ticks(model, 100000u);
    }
}

/* Towards the command, no further than the slew allows in a period. */
static void drive_amplifier(struct model *model)
{
    const int64_t limit_mV = model->value[DCMP_VOLTAGE_LIMIT_MV];
    const int64_t most_uV = (int64_t)model->value[DCMP_SLEW_MV_PER_MS] * model->value[DCMP_PERIOD_US];
    int64_t wanted_mV = model->command_mV;
    wanted_mV = wanted_mV > limit_mV ? limit_mV : wanted_mV;
    wanted_mV = wanted_mV < -limit_mV ? -limit_mV : wanted_mV;
    int64_t way_uV = 1000 * wanted_mV - model->voltage_uV;
    if (model->value[DCMP_SLEW_MV_PER_MS] != 0) {
        way_uV = way_uV > most_uV ? most_uV : way_uV;
        way_uV = way_uV < -most_uV ? -most_uV : way_uV;
    }
    model->voltage_uV += way_uV;
    model->limited = model->voltage_uV != 1000 * model->command_mV;
}

void model_tick(struct model *model, uint32_t counts, const struct dcmp_edge *edge)
{
    const int64_t applied_uV = model->voltage_uV;
    const bool missed = !model->driven;
    if (!model->alive) {
        return;
    }
    model->value[DCMP_TICK] = (int32_t)(model->ticks & 0x7FFFFFFFu);
    model->ticks++;
    model->driven = false;
    model_judge_tick(model, counts, missed);
    if (model->state == MODEL_RUN) {
        drive_amplifier(model);
    }
    report_fault(model);
    report_sample(model, applied_uV, missed);
    report_edge(model, edge);
    report_health(model);
}

bool model_transmit(struct model *model, struct dcmp_frame *frame)
{
    for (uint32_t i = 0; i < (uint32_t)REPORTS; i++) {
        if (model->waiting[i]) {
            model->waiting[i] = false;
            *frame = model->reports[i];
            return true;
        }
    }
    if (model->answers_waiting == 0u) {
        return false;
    }
    const struct model_answer answer = model->answers[model->answer];
    model->answer = (model->answer + 1u) % MODEL_ANSWERS;
    model->answers_waiting--;
    *frame = wire_begin((enum wire_number)answer.number, model->node);
    if (answer.number == (uint8_t)WIRE_IDENTITY) {
        wire_put(frame, DCMP_PROTOCOL_HASH, 4);
        wire_put(frame, model->version, 2);
    } else {
        const bool known = answer.id < MODEL_PARAMETERS;
        wire_put(frame, answer.id, 1);
        wire_put(frame, known ? (uint32_t)model->value[answer.id] : 0u, 4);
    }
    wire_put(frame, answer.last, 1);
    wire_seal(frame);
    return true;
}
