#include "dcmp_run_phases.h"
#include "law_checks.h"

static struct dcmp_objection objection_of(double cause, int64_t tick)
{
    const struct dcmp_objection objection = {tick, (enum dcmp_cause)(int)cause, REAL(0.0), REAL(0.0)};
    return objection;
}

static real limited(struct dcmp_phases_setup setup, real demand, real last)
{
    const real most = setup.voltage_limit;
    const real below = demand < most ? demand : most;
    const real within = below > -most ? below : -most;
    const real slower = within < last + setup.slew ? within : last + setup.slew;
    return slower > last - setup.slew ? slower : last - setup.slew;
}

void CHECK(phases)(const double *given, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_phases_setup setup = {(real)given[0], (real)given[1], (real)given[2],
                                            (real)given[3], (real)given[4], given[5] != 0.0};
    struct dcmp_phases now = {0};
    for (uint32_t i = 0; i < n; i++, rows += 7, out += 9) {
        const int64_t tick = (int64_t)rows[0];
        const real demand = (real)rows[2];
        struct dcmp_notes notes = {0};
        dcmp_phases_arm(&now, &setup, tick, &notes);
        if (now.phase == DCMP_RUN_PROBING) {
            dcmp_phases_probed(&now, &setup, tick, objection_of(rows[3], tick), rows[4] != 0.0, (real)rows[5], &notes);
        }
        const bool begins = dcmp_phases_settled(&now, &setup, tick, &notes);
        dcmp_phases_judge(&now, &setup, tick, objection_of(rows[1], tick), demand, &notes);
        const real voltage = dcmp_has_authority(&now) ? limited(setup, demand, now.last)
                                                      : dcmp_partial_voltage(&now, &setup, tick, demand);
        out[0] = (double)dcmp_phases_send(&now, voltage, objection_of(rows[6], tick), tick, &notes);
        out[1] = (double)now.phase;
        out[2] = begins ? 1.0 : 0.0;
        out[3] = now.over ? 1.0 : 0.0;
        out[4] = now.orderly ? 1.0 : 0.0;
        out[5] = (double)now.cause.cause;
        out[6] = (double)now.cause.tick;
        out[7] = (double)notes.count;
        out[8] = notes.count > 0u ? (double)notes.note[notes.count - 1u].first : -1.0;
    }
}
