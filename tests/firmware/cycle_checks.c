#include "../../firmware/boards/simlib/run_setup.h"
#include "law_checks.h"

#define ROW 39
#define NOTES 5u

static void put_cycle(const struct dcmp_cycle *now, double *out)
{
    const struct dcmp_objection cause = now->phases.cause;
    out[1] = (double)now->estimate.position;
    out[2] = (double)now->estimate.velocity;
    out[3] = (double)now->estimate.disturbance;
    out[4] = (double)now->reference.position;
    out[5] = (double)now->reference.velocity;
    out[6] = (double)now->reference.acceleration;
    out[7] = (double)now->demand;
    out[8] = (double)now->under_way;
    out[10] = (double)now->phases.phase;
    out[11] = now->phases.over ? 1.0 : 0.0;
    out[12] = now->phases.orderly ? 1.0 : 0.0;
    out[13] = (double)cause.cause;
    out[14] = (double)cause.tick;
    out[15] = (double)cause.first;
    out[16] = (double)cause.second;
    out[17] = now->remembers ? 1.0 : 0.0;
    out[18] = (double)now->notes.count;
    for (uint32_t i = 0; i < NOTES && i < now->notes.count; i++) {
        const struct dcmp_note note = now->notes.note[i];
        out[19u + 3u * i] = (double)note.code;
        out[20u + 3u * i] = (double)note.first;
        out[21u + 3u * i] = (double)note.second;
    }
    out[34] = (double)now->polarity.gain.gain;
    out[35] = (double)now->polarity.gain.deviation;
    out[36] = (double)now->trajectory.x0;
    out[37] = (double)now->trajectory.start;
    out[38] = now->trajectory.begun ? 1.0 : 0.0;
}

void CHECK(cycle)(const double *parameters, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_cycle_setup setup = run_setup_of((const struct run_parameters *)(const void *)parameters);
    struct dcmp_cycle now = dcmp_cycle_begin(&setup);
    for (uint32_t i = 0; i < n; i++, rows += 8, out += ROW) {
        const struct dcmp_measurement sample = {(int64_t)rows[0], (real)rows[1], (real)rows[2]};
        const struct dcmp_reference reference = {(real)rows[5], (real)rows[6], (real)rows[7]};
        for (int k = 0; k < ROW; k++) {
            out[k] = 0.0;
        }
        if (dcmp_cycle_leaves_out(&now, &setup, sample)) {
            out[0] = 1.0;
            continue;
        }
        out[9] = dcmp_cycle_sense(&now, &setup, sample, (real)rows[3], (real)rows[4]) ? 1.0 : 0.0;
        (void)dcmp_cycle_act(&now, &setup, sample, reference);
        put_cycle(&now, out);
    }
}
