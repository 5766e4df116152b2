/* The simulated rig: pendulum with set-valued friction, encoder and amplifier.
 * sim_backend/{plant,encoder,amplifier}.py have the same operations in the same order, and say why they are these.
 * State goes in and out by value. No branches, except in dcmp_plant_advance. */
#ifndef DCMP_PLANT_H
#define DCMP_PLANT_H

#include <stdint.h>

#include "dcmp_random.h"

/* ----------------------------------------------------------------------------------------------------------- plant */

/* The pendulum, all over the inertia J: eta/J = eta + eta_amplitude sin(eta_rate t). */
struct dcmp_plant_model {
    real f0;            /* 1/s */
    real f1;            /* rad/s2 */
    real gravity;       /* rad/s2 */
    real ku;            /* (rad/s2)/V */
    real eta;           /* rad/s2 */
    real eta_amplitude; /* rad/s2 */
    real eta_rate;      /* rad/s */
};

/* What the host believes: the true disturbance is defined by it. */
struct dcmp_plant_belief {
    real f0; /* 1/s */
    real ku; /* (rad/s2)/V */
};

struct dcmp_plant {
    real position; /* rad */
    real velocity; /* rad/s */
    real before;   /* rad/s, the velocity before the last step */
};

/* The acceleration that is held over a period, rad/s2; t in s at its start. */
static inline real dcmp_plant_held(struct dcmp_plant_model model, real t, real voltage)
{
    const real external = model.eta + model.eta_amplitude * dcmp_sine(model.eta_rate * t);
    return external + model.ku * voltage;
}

/* One step of h, s, after Moreau: friction takes away what velocity it can. */
static inline struct dcmp_plant dcmp_plant_step(struct dcmp_plant now, struct dcmp_plant_model model, real h,
                                                real held)
{
    const real most = h * model.f1;
    const real free =
        now.velocity + h * (held - model.f0 * now.velocity - model.gravity * dcmp_sine(now.position));
    const real slower = free - most;
    const real less_slow = free + most;
    const real falling = free < -most ? less_slow : REAL(0.0);
    const real velocity = free > most ? slower : falling;
    const struct dcmp_plant next = {now.position + h * velocity, velocity, now.velocity};
    return next;
}

/* w of eq. (3) over the last step, rad/s2. */
static inline real dcmp_plant_disturbance(struct dcmp_plant now, struct dcmp_plant_belief belief, real h, real voltage)
{
    return (now.velocity - now.before) / h + belief.f0 * now.before - belief.ku * voltage;
}

/* A period of `steps` steps under one voltage, V; `period` is its number since the start. */
static inline struct dcmp_plant dcmp_plant_advance(struct dcmp_plant now, struct dcmp_plant_model model, real h,
                                                   int64_t steps, int64_t period, real voltage)
{
    const real held = dcmp_plant_held(model, REAL(period * steps) * h, voltage);
    for (int64_t step = 0; step < steps; step++) {
        now = dcmp_plant_step(now, model, h, held);
    }
    return now;
}

/* --------------------------------------------------------------------------------------------------------- encoder */

struct dcmp_sim_encoder {
    real count; /* rad; 0 for an ideal encoder */
    real phase; /* counts */
    real noise; /* counts, or rad of an ideal encoder: standard deviation */
};

/* The measured position, rad; `normal` is the noise of this reading over its deviation. */
static inline real dcmp_sim_encoder_read(struct dcmp_sim_encoder encoder, real position, real normal)
{
    const real noise = encoder.noise * normal;
    const real count = encoder.count > REAL(0.0) ? encoder.count : REAL(1.0);
    const real clean = position / count + encoder.phase;
    const real noisy = clean + noise;
    const real counts = encoder.noise > REAL(0.0) ? noisy : clean;
    const real shown = count * (dcmp_floor(counts + REAL(0.5)) - encoder.phase);
    const real off = position + noise;
    const real ideal = encoder.noise > REAL(0.0) ? off : position;
    return encoder.count > REAL(0.0) ? shown : ideal;
}

/* ------------------------------------------------------------------------------------------------------- amplifier */

struct dcmp_sim_amplifier {
    real limit;     /* V, either way */
    real slew;      /* V a period */
    real dead_zone; /* V, either way */
    real quantum;   /* V; 0 for none */
    real delay;     /* periods from command to output: 0 to 3 */
};

struct dcmp_sim_amplifier_state {
    real waiting_1; /* V, the commands of the last periods */
    real waiting_2;
    real waiting_3;
    real ramp; /* V, the slewed command */
    real output; /* V */
};

/* The command that counts, V: one that is not finite is 0 V. */
static inline real dcmp_sim_command(real voltage)
{
    return voltage - voltage == REAL(0.0) ? voltage : REAL(0.0);
}

/* The whole number of quanta that is nearest, V, within the limit. */
static inline real dcmp_sim_quantised(struct dcmp_sim_amplifier amplifier, real voltage)
{
    const real quantum = amplifier.quantum > REAL(0.0) ? amplifier.quantum : REAL(1.0);
    const real steps = voltage / quantum;
    const real nearest = dcmp_nearest(steps);
    const real whole = quantum * (dcmp_magnitude(steps) < DCMP_WHOLE ? nearest : steps);
    const real toward_zero = whole < REAL(0.0) ? whole + quantum : whole - quantum;
    const real output = dcmp_magnitude(whole) > amplifier.limit ? toward_zero : whole;
    return amplifier.quantum > REAL(0.0) ? output : voltage;
}

/* One period of an amplifier that is on; the newest command, V, is held. */
static inline struct dcmp_sim_amplifier_state dcmp_sim_amplifier_step(struct dcmp_sim_amplifier_state now,
                                                                      struct dcmp_sim_amplifier amplifier,
                                                                      real newest)
{
    const real late_3 = amplifier.delay > REAL(2.0) ? now.waiting_3 : now.waiting_2;
    const real late_2 = amplifier.delay > REAL(1.0) ? late_3 : now.waiting_1;
    const real due = amplifier.delay > REAL(0.0) ? late_2 : newest;
    const real above = due < -amplifier.limit ? -amplifier.limit : due;
    const real wanted = due > amplifier.limit ? amplifier.limit : above;
    const real highest = now.ramp + amplifier.slew;
    const real lowest = now.ramp - amplifier.slew;
    const real rising = wanted < highest ? wanted : highest;
    const real ramp = rising > lowest ? rising : lowest;
    const real whole = dcmp_sim_quantised(amplifier, ramp);
    const real output = dcmp_magnitude(whole) < amplifier.dead_zone ? REAL(0.0) : whole;
    const struct dcmp_sim_amplifier_state next = {newest, now.waiting_1, now.waiting_2, ramp, output};
    return next;
}

#endif
