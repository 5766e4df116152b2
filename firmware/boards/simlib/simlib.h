/* The simulated rig of one run: amplifier, pendulum and encoder. The caller owns the memory, a `struct simlib`, which it fills,
 * reads and writes as it likes between two calls. sim_backend/core_library.py has the same fields in the same order. */
#ifndef SIMLIB_H
#define SIMLIB_H

#include <stddef.h>
#include <stdint.h>

#include "dcmp_plant.h"

#define LOST_MAX 100000 /* in a row; with the largest probability, 0.9, so many are never lost */

struct simlib_encoder {
    struct dcmp_sim_encoder model;
    int64_t reads; /* so far */
};

struct simlib_amplifier {
    struct dcmp_sim_amplifier model;
    struct dcmp_sim_amplifier_state state;
    real newest; /* V, the command */
};

struct simlib_plant {
    struct dcmp_plant_model model;
    struct dcmp_plant_belief belief;
    real step; /* s */
    int64_t steps; /* of a period */
    int64_t periods; /* so far */
    struct dcmp_plant state;
    real disturbance; /* rad/s2, w of eq. (3) */
};

/* Fields of 8 bytes. */
struct simlib {
    int64_t tick; /* of the sample */
    int64_t samples; /* so far */
    real voltage; /* V, applied over the last period */
    real shown; /* rad, the measured position */
    int64_t seed;
    real lost; /* probability that a sample does not reach the host */
    struct simlib_plant plant;
    struct simlib_encoder encoder;
    struct simlib_amplifier amplifier;
};

static inline struct dcmp_random_key key_of(int64_t seed)
{
    const uint64_t bits = (uint64_t)seed;
    const struct dcmp_random_key key = {(uint32_t)bits, (uint32_t)(bits >> 32)};
    return key;
}

/* The plant alone, a period under `voltage`. */
static inline void plant_period(struct simlib *sim)
{
    struct simlib_plant *plant = &sim->plant;
    plant->state =
        dcmp_plant_advance(plant->state, plant->model, plant->step, plant->steps, plant->periods, sim->voltage);
    plant->disturbance = dcmp_plant_disturbance(plant->state, plant->belief, plant->step, sim->voltage);
    plant->periods++;
}

/* Amplifier and plant, a period. */
static inline void rig_period(struct simlib *sim)
{
    struct simlib_amplifier *amplifier = &sim->amplifier;
    amplifier->state =
        dcmp_sim_amplifier_step(amplifier->state, amplifier->model, dcmp_sim_command(amplifier->newest));
    sim->voltage = amplifier->state.output;
    plant_period(sim);
    sim->tick++;
}

/* What the encoder shows now. */
static inline void rig_read(struct simlib *sim)
{
    struct simlib_encoder *encoder = &sim->encoder;
    real normal = REAL(0.0);
    if (encoder->model.noise > REAL(0.0)) {
        normal = dcmp_random_normal(key_of(sim->seed), DCMP_STREAM_ENCODER_NOISE, (uint64_t)encoder->reads);
        encoder->reads++;
    }
    sim->shown = dcmp_sim_encoder_read(encoder->model, sim->plant.state.position, normal);
}

/* Whether the sample of a tick does not reach the host. */
static inline int is_lost(const struct simlib *sim)
{
    return sim->lost > REAL(0.0) &&
           dcmp_random_uniform(key_of(sim->seed), DCMP_STREAM_LOST_SAMPLES, (uint64_t)sim->tick) < sim->lost;
}

/* The next sample that reaches the host: of now the first, of a period later every other, or of more if some are
 * lost. */
static inline void rig_sample(struct simlib *sim)
{
    if (sim->samples > 0) {
        rig_period(sim);
        for (int32_t lost = 0; lost < LOST_MAX && is_lost(sim); lost++) {
            rig_period(sim);
        }
    }
    sim->samples++;
    rig_read(sim);
}

#endif
