#include "dcmp_plant.h"
#include "law_checks.h"

void CHECK(plant)(const double *setup, uint32_t steps, const double *voltages, double *out, uint32_t n)
{
    const struct dcmp_plant_model model = {(real)setup[0], (real)setup[1], (real)setup[2], (real)setup[3],
                                           (real)setup[4], (real)setup[5], (real)setup[6]};
    const struct dcmp_plant_belief belief = {(real)setup[7], (real)setup[8]};
    const real h = (real)setup[9];
    struct dcmp_plant plant = {(real)setup[10], REAL(0.0), REAL(0.0)};
    for (uint32_t i = 0; i < n; i++, out += 3) {
        plant = dcmp_plant_advance(plant, model, h, (int64_t)steps, (int64_t)i, (real)voltages[i]);
        out[0] = (double)plant.position;
        out[1] = (double)plant.velocity;
        out[2] = (double)dcmp_plant_disturbance(plant, belief, h, (real)voltages[i]);
    }
}

void CHECK(encoder)(const double *setup, const double *rows, double *out, uint32_t n)
{
    const struct dcmp_sim_encoder encoder = {(real)setup[0], (real)setup[1], (real)setup[2]};
    for (uint32_t i = 0; i < n; i++, rows += 2) {
        out[i] = (double)dcmp_sim_encoder_read(encoder, (real)rows[0], (real)rows[1]);
    }
}

void CHECK(amplifier)(const double *setup, const double *commands, double *out, uint32_t n)
{
    const struct dcmp_sim_amplifier amplifier = {(real)setup[0], (real)setup[1], (real)setup[2], (real)setup[3],
                                                 (real)setup[4]};
    struct dcmp_sim_amplifier_state state = {REAL(0.0), REAL(0.0), REAL(0.0), REAL(0.0), REAL(0.0)};
    for (uint32_t i = 0; i < n; i++) {
        state = dcmp_sim_amplifier_step(state, amplifier, dcmp_sim_command((real)commands[i]));
        out[i] = (double)state.output;
    }
}
