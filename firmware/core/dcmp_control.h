/* The law: the default observer R1 (super-twisting), the predictor, the controller and the known part of friction.
 * State goes in and out by value; what depends on the length of a step alone is computed by the host and handed in as
 * numbers. dcmp_hil/control has the same operations in the same order, and says why they are these.
 * No branches where many lanes run: only dcmp_super_twisting_update and dcmp_step_periods have some. */
#ifndef DCMP_CONTROL_H
#define DCMP_CONTROL_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_elementary.h"

struct dcmp_estimate {
    real position;    /* rad */
    real velocity;    /* rad/s */
    real disturbance; /* rad/s2 */
};

struct dcmp_reference {
    real position;     /* rad */
    real velocity;     /* rad/s */
    real acceleration; /* rad/s2 */
};

/* ------------------------------------------------------------------------------------------------------ observer R1 */

/* One step of the copy in differences, and the gains of an innovation at the bandwidth's floor. */
struct dcmp_step {
    real f12;
    real f22;
    real gu1;
    real gu2;
    real h01;
    real h02;
    real h11;
    real h12;
    real k1;
    real k2; /* over T */
    real k3; /* over T^2 */
};

/* What is the same for steps of every length. */
struct dcmp_tuning {
    real ku;         /* (rad/s2)/V */
    real L1;         /* 1/s */
    real w1;         /* L2 + f0 L1, 1/s2 */
    real w2;         /* L1 + f0, 1/s */
    real M;          /* rad/s3 */
    real mu0;        /* rad/s */
    real floor_from; /* rad: an innovation at least this large is slower than the floor */
};

struct dcmp_super_twisting {
    real y;  /* rad, of the last sample */
    real z1; /* the copy */
    real z2;
    real v1; /* the differentiator */
    real v2;
    real v3;
};

struct dcmp_gains {
    real k1;
    real k2;
    real k3;
};

#define DCMP_ROOT_R REAL(0.9806592527262586) /* roots of the differentiator's polynomial: -r and -a +- i c */
#define DCMP_ROOT_A REAL(0.5096703736368707)
#define DCMP_ROOT_C REAL(0.9284021317842834)
#define DCMP_BANDWIDTH_STEP_MAX REAL(50.0)
#define DCMP_INNOVATION_MIN REAL(1e-30) /* rad: below it, the sliding bandwidth has no value */
#define DCMP_SLOPE_MIN REAL(1e-30)      /* rad/s3: below it, M is none */

/* The gains that put the poles of a step's error at exp(p x); x is bandwidth times step. */
static inline struct dcmp_gains dcmp_matched_gains(real bandwidth_step)
{
    const real x = bandwidth_step > DCMP_BANDWIDTH_STEP_MAX ? DCMP_BANDWIDTH_STEP_MAX : bandwidth_step;
    const real e = dcmp_expm1_within(-DCMP_ROOT_A * x);
    const real s = dcmp_sine_within(REAL(0.5) * DCMP_ROOT_C * x);
    const real d = -dcmp_expm1_within(-DCMP_ROOT_R * x);
    const real g = (REAL(1.0) + e) * (s * s);
    const real e0 = e * e + REAL(4.0) * g;
    const real e1 = REAL(2.0) * (REAL(2.0) * g - e);
    const real p1 = d + e1;
    const real p3 = d * e0;
    const real p2 = d * e1 + e0 - REAL(0.5) * p3;
    const struct dcmp_gains gains = {p1 - p2 + REAL(0.5) * p3, p2 - p3, p3};
    return gains;
}

/* The gains of an innovation so small that the sliding term is faster than the floor. */
static inline struct dcmp_gains dcmp_sliding_gains(real size, struct dcmp_tuning tuning, real dt)
{
    const real sliding = dcmp_inverse_cube_root(size / tuning.M);
    const real defined = size >= DCMP_INNOVATION_MIN ? sliding : tuning.mu0;
    const real mu = tuning.M >= DCMP_SLOPE_MIN ? defined : tuning.mu0;
    const struct dcmp_gains matched = dcmp_matched_gains(mu * dt);
    const struct dcmp_gains gains = {matched.k1, matched.k2 / dt, matched.k3 / (dt * dt)};
    return gains;
}

/* Begin at rest where the arm is. */
static inline struct dcmp_super_twisting dcmp_super_twisting_restart(real y)
{
    const struct dcmp_super_twisting first = {y, y, REAL(0.0), REAL(0.0), REAL(0.0), REAL(0.0)};
    return first;
}

/* Advance by a step of dt, s, over the voltage really applied, V, to the position y, rad; nothing is corrected. */
static inline struct dcmp_super_twisting dcmp_super_twisting_advance(struct dcmp_super_twisting now, real ku,
                                                                     struct dcmp_step step, real dt, real y,
                                                                     real voltage)
{
    const real u = ku * voltage;
    const real e0 = now.y - now.z1;
    const real e1 = y - now.z1;
    const real z1 = now.z1 + (step.h01 * e0 + step.h11 * e1 + step.f12 * now.z2 + step.gu1 * u);
    const real z2 = step.f22 * now.z2 + step.gu2 * u + step.h02 * e0 + step.h12 * e1;
    const real v1 = now.v1 + dt * (now.v2 + REAL(0.5) * dt * now.v3);
    const real v2 = now.v2 + dt * now.v3;
    const struct dcmp_super_twisting next = {y, z1, z2, v1, v2, now.v3};
    return next;
}

/* The innovation, rad, of a state that was advanced. */
static inline real dcmp_innovation(struct dcmp_super_twisting now)
{
    return now.y - now.z1 - now.v1;
}

/* Correct a state that was advanced by its innovation b, rad. */
static inline struct dcmp_super_twisting dcmp_super_twisting_correct(struct dcmp_super_twisting now,
                                                                     struct dcmp_gains gains, real b)
{
    const struct dcmp_super_twisting next = {
        now.y, now.z1, now.z2, now.v1 + gains.k1 * b, now.v2 + gains.k2 * b, now.v3 + gains.k3 * b};
    return next;
}

/* Advance by a step of dt, s, over the voltage really applied, V, and correct by the position y, rad. On an encoder two of three
 * innovations are above the floor: a run by itself is spared what the sliding gains cost. */
static inline struct dcmp_super_twisting dcmp_super_twisting_update(struct dcmp_super_twisting now,
                                                                    struct dcmp_tuning tuning, struct dcmp_step step,
                                                                    real dt, real y, real voltage)
{
    const struct dcmp_super_twisting ahead = dcmp_super_twisting_advance(now, tuning.ku, step, dt, y, voltage);
    const real b = dcmp_innovation(ahead);
    const real size = dcmp_magnitude(b);
    struct dcmp_gains gains = {step.k1, step.k2, step.k3};
    if (!(size >= tuning.floor_from)) {
        gains = dcmp_sliding_gains(size, tuning, dt);
    }
    return dcmp_super_twisting_correct(ahead, gains, b);
}

static inline struct dcmp_estimate dcmp_super_twisting_estimate(struct dcmp_super_twisting now,
                                                                struct dcmp_tuning tuning)
{
    const struct dcmp_estimate estimate = {now.z1 + now.v1, now.z2 + now.v2 + tuning.L1 * now.v1,
                                           now.v3 + tuning.w2 * now.v2 + tuning.w1 * now.v1};
    return estimate;
}

/* ------------------------------------------------------------------------------------------------- lengths of a step */

#define DCMP_STEP_PERIODS_MAX 10
#define DCMP_STEP_RESTART 0   /* the first sample, or one after a gap too long to bridge */
#define DCMP_STEP_OTHER (-1)  /* no whole number of periods: the coefficients are those of this step alone */
#define DCMP_STEP_NONE (-2)   /* time did not advance */

struct dcmp_step_lengths {
    real period;    /* s */
    real tolerance; /* s, either way */
};

/* How many periods a step of dt, s, has, 1 to DCMP_STEP_PERIODS_MAX, or one of the above; NaN restarts. */
static inline int32_t dcmp_step_periods(real dt, struct dcmp_step_lengths lengths)
{
    const real longest = REAL(DCMP_STEP_PERIODS_MAX) * lengths.period + lengths.tolerance;
    const real n = dcmp_nearest(dt / lengths.period);
    if (dt <= REAL(0.0)) {
        return DCMP_STEP_NONE;
    }
    if (!(dt < longest)) {
        return DCMP_STEP_RESTART;
    }
    if (n >= REAL(1.0) && dcmp_magnitude(dt - n * lengths.period) < lengths.tolerance) {
        return (int32_t)n;
    }
    return DCMP_STEP_OTHER;
}

/* --------------------------------------------------------------------------------------------------------- predictor */

/* x'' = -f0 x' + d, d held over a period, solved exactly: x1 += p1 x2 + p2 d; x2 = a x2 + p1 d. */
struct dcmp_predictor {
    real a;
    real p1; /* s */
    real p2; /* s2 */
    real ku; /* (rad/s2)/V */
};

/* The state a period later, under the voltage that is under way, V. */
static inline struct dcmp_estimate dcmp_ahead(struct dcmp_estimate now, struct dcmp_predictor predictor, real voltage)
{
    const real drive = now.disturbance + predictor.ku * voltage;
    const struct dcmp_estimate next = {now.position + (predictor.p1 * now.velocity + predictor.p2 * drive),
                                       predictor.a * now.velocity + predictor.p1 * drive, now.disturbance};
    return next;
}

/* -------------------------------------------------------------------------------------------------------- controller */

struct dcmp_pd {
    real kp;           /* 1/s2 */
    real kd;           /* 1/s */
    real compensation; /* 1 with the estimated disturbance, 0 without */
    real f0;           /* 1/s */
    real volts;        /* 1/ku */
};

/* The voltage to ask for, V; both arguments hold for the instant at which it takes effect. */
static inline real dcmp_pd_voltage(struct dcmp_pd pd, struct dcmp_reference reference, struct dcmp_estimate estimate)
{
    const real u = reference.acceleration - pd.compensation * estimate.disturbance -
                   pd.kp * (estimate.position - reference.position) -
                   pd.kd * (estimate.velocity - reference.velocity) + pd.f0 * estimate.velocity;
    return u * pd.volts;
}

/* -------------------------------------------------------------------------------------------- friction, fed forward */

#define DCMP_CROSSING REAL(0.005) /* rad/s: the sign is a ramp inside it */

/* The friction believed to act, rad/s2, by the reference's velocity, rad/s; f1 in rad/s2. */
static inline real dcmp_known_friction(real f1, real velocity)
{
    const real ratio = velocity / DCMP_CROSSING;
    const real at_most = ratio < REAL(1.0) ? ratio : REAL(1.0);
    const real sign = at_most > REAL(-1.0) ? at_most : REAL(-1.0);
    return -f1 * sign;
}

/* The voltage of a sample for the observer, V, with the friction that acted since the last one; volts is 1/ku. */
static inline real dcmp_told_voltage(real voltage, real friction, real volts)
{
    return voltage + friction * volts;
}

/* The estimate with the friction that will act when the command does. */
static inline struct dcmp_estimate dcmp_whole_estimate(struct dcmp_estimate rest, real friction)
{
    const struct dcmp_estimate whole = {rest.position, rest.velocity, rest.disturbance + friction};
    return whole;
}

#endif
