/* Amplifier, plant and encoder of every lane. */
#ifndef LANES_PLANT_H
#define LANES_PLANT_H

#include "dcmp_plant.h"
#include "lanes_cycle.h"

/* The amplifier's voltage over the period that ends, of one lane. */
static inline double lanes_amplified(struct lanes_state *restrict s, struct dcmp_sim_amplifier amplifier, int l)
{
    const struct dcmp_sim_amplifier_state now = {s->waiting[l], 0.0, 0.0, s->ramp[l], 0.0};
    const struct dcmp_sim_amplifier_state next = dcmp_sim_amplifier_step(now, amplifier, s->sent[l]);
    s->waiting[l] = next.waiting_1;
    s->ramp[l] = next.ramp;
    return next.output;
}

static inline void lanes_amplify(const struct lanes_common *common, const struct lanes_parameters *restrict p,
                                 struct lanes_state *restrict s, double *restrict applied)
{
    const double delay = common->delayed != 0 ? 1.0 : 0.0;
    if (common->shaped != 0) {
        for (int l = 0; l < DCMP_LANES; l++) {
            const struct dcmp_sim_amplifier amplifier = {p->amplifier_limit[l], p->amplifier_slew[l],
                                                         p->dead_zone[l], p->quantum[l], delay};
            applied[l] = lanes_amplified(s, amplifier, l);
        }
    } else {
        for (int l = 0; l < DCMP_LANES; l++) {
            const struct dcmp_sim_amplifier amplifier = {p->amplifier_limit[l], __builtin_inf(), 0.0, 0.0, delay};
            applied[l] = lanes_amplified(s, amplifier, l);
        }
    }
}

static inline struct dcmp_plant_model lanes_plant_model(const struct lanes_parameters *p, int l)
{
    const struct dcmp_plant_model model = {p->plant_f0[l],  p->plant_f1[l],
                                           p->plant_gravity[l], p->plant_ku[l],
                                           p->plant_eta[l], p->plant_eta_amplitude[l],
                                           p->plant_eta_rate[l]};
    return model;
}

/* One step of the plant. */
static inline void lanes_move_step(const struct lanes_parameters *restrict p, struct lanes_state *restrict s,
                                   const double *restrict held)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const struct dcmp_plant now = {s->x1[l], s->x2[l], 0.0};
        const struct dcmp_plant next = dcmp_plant_step(now, lanes_plant_model(p, l), p->plant_step[l], held[l]);
        s->x1[l] = next.position;
        s->x2[l] = next.velocity;
        s->before[l] = next.before;
    }
}

/* The plant over the period that ends at `tick`. */
static inline void lanes_move(const struct lanes_common *common, const struct lanes_parameters *restrict p,
                              struct lanes_state *restrict s, const double *restrict applied, int64_t tick)
{
    double held[DCMP_LANES];
    const int64_t begun = (tick - 1) * common->plant_steps;
    const double steps = (double)begun;
    for (int l = 0; l < DCMP_LANES; l++) {
        held[l] = dcmp_plant_held(lanes_plant_model(p, l), steps * p->plant_step[l], applied[l]);
    }
    for (int64_t step = 0; step < common->plant_steps; step++) {
        lanes_move_step(p, s, held);
    }
    for (int l = 0; l < DCMP_LANES; l++) {
        const struct dcmp_plant now = {s->x1[l], s->x2[l], s->before[l]};
        const struct dcmp_plant_belief belief = {p->f0[l], p->ku[l]};
        s->w[l] = dcmp_plant_disturbance(now, belief, p->plant_step[l], applied[l]);
    }
}

/* What the encoder shows. */
static inline void lanes_measure(const struct lanes_common *common, const struct lanes_parameters *restrict p,
                                 const struct lanes_state *restrict s, double *restrict y)
{
    if (common->noisy != 0) {
        for (int l = 0; l < DCMP_LANES; l++) {
            const struct dcmp_sim_encoder encoder = {p->count[l], p->phase[l], p->noise[l]};
            const struct dcmp_random_key key = {(uint32_t)p->seed_low[l], (uint32_t)p->seed_high[l]};
            const double normal =
                dcmp_random_normal(key, DCMP_STREAM_ENCODER_NOISE, (uint64_t)s->periods[l]);
            y[l] = dcmp_sim_encoder_read(encoder, s->x1[l], normal);
        }
    } else {
        for (int l = 0; l < DCMP_LANES; l++) {
            const struct dcmp_sim_encoder encoder = {p->count[l], p->phase[l], 0.0};
            y[l] = dcmp_sim_encoder_read(encoder, s->x1[l], 0.0);
        }
    }
}

/* Lose the sample of this tick in some of the lanes. */
static inline void lanes_lose(const struct lanes_parameters *restrict p, struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const struct dcmp_random_key key = {(uint32_t)p->seed_low[l], (uint32_t)p->seed_high[l]};
        const double drawn = dcmp_random_uniform(key, DCMP_STREAM_LOST_SAMPLES, (uint64_t)c->tick);
        c->take[l] = drawn < p->lost[l] ? 0 : c->take[l];
    }
}

#endif
