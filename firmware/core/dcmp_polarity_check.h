/* The polarity check: a volt up, a volt down, before engaging: which way does the arm go, and how far. The fit of the motor's
 * gain is made of sums that grow with each sample. dcmp_hil/safety/polarity_check.py and motor_gain_fit.py have the same
 * operations in the same order, and say why they are these. A state of zeros is the one before the first sample. */
#ifndef DCMP_POLARITY_CHECK_H
#define DCMP_POLARITY_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_cause.h"
#include "dcmp_elementary.h"
#include "dcmp_time.h"

#define DCMP_REST_TIME REAL(0.1)              /* s at 0 V: is the arm at rest */
#define DCMP_PUSH_TIME_MAX REAL(0.1)          /* s each way at most */
#define DCMP_REST_TRAVEL_MAX REAL(0.02)       /* rad, that the arm may move while it is watched */
#define DCMP_PUSH_TRAVEL_MAX REAL(0.03)       /* rad, at which a push ends early */
#define DCMP_VOLTAGE_RISEN_SHARE REAL(0.9)    /* of the voltage */
#define DCMP_COASTING_SPEED_RATIO REAL(3.0)   /* times the mean speed */
#define DCMP_COASTING_TRAVEL_MAX REAL(0.032)  /* rad, where a slow push ends */
#define DCMP_RETURN_TRAVEL_MAX REAL(0.08)     /* rad, at which the way back ends early */
#define DCMP_VOLTAGE_SHARE_MIN REAL(0.6)      /* of the voltage asked for, that must be applied */
#define DCMP_GAIN_RATIO_MAX REAL(3.0)         /* measured over believed motor gain, either way */
#define DCMP_SIGNIFICANCE_DEVIATIONS REAL(4.0) /* standard deviations */
#define DCMP_NOISE_COUNTS REAL(0.4)           /* counts, of a position */
#define DCMP_NOISE_MIN REAL(1e-4)             /* rad, of a position */
#define DCMP_DISTURBANCE_DEVIATION REAL(2.0)  /* rad/s2, of what may push besides */
#define DCMP_GAIN_DEVIATION_RATIO REAL(3.0)   /* times the believed motor gain: what is expected before a sample */

struct dcmp_polarity_setup {
    real ku;      /* (rad/s2)/V, the believed motor gain */
    real voltage; /* V, of a push */
    real gravity; /* rad/s2, of the pendulum, as believed */
    real count;   /* rad, one count of the encoder; 0 for an ideal one */
};

/* -------------------------------------------------------------------------------------------------- the motor's gain */

/* Sums over samples of the products of 1, q = t^2 / 2, m = the way that 1 (rad/s2)/V would have moved the arm, and z = the
 * way it moved. */
struct dcmp_gain_sums {
    real n11;
    real n12;
    real n13;
    real n22;
    real n23;
    real n33;
    real b1;
    real b2;
    real b3;
};

struct dcmp_gain_fit {
    real t;          /* s, of the last sample, since the pushes began */
    real speed;      /* of m */
    real m;          /* s2 V */
    real fall_speed; /* rad/s, from gravity */
    real fall;       /* rad */
    real farthest;   /* rad, either way */
    struct dcmp_gain_sums all;
    struct dcmp_gain_sums out; /* as they were at the newest farthest point: until the arm turns, friction is constant */
};

struct dcmp_motor_gain {
    real gain;      /* (rad/s2)/V */
    real deviation; /* (rad/s2)/V, standard deviation */
};

/* Take in a sample: the time since the pushes began, s, the way from there, rad, and the voltage of the period before, V. */
static inline struct dcmp_gain_fit dcmp_gain_fit_add(struct dcmp_gain_fit fit, real gravity, real t, real moved,
                                                     real voltage)
{
    const real step = t - fit.t;
    const real pull = gravity * dcmp_sine(moved);
    struct dcmp_gain_fit next = fit;
    next.t = t;
    next.speed = fit.speed + step * voltage;
    next.m = fit.m + step * (next.speed - REAL(0.5) * step * voltage);
    next.fall_speed = fit.fall_speed + step * pull;
    next.fall = fit.fall + step * (next.fall_speed - REAL(0.5) * step * pull);
    const real q = REAL(0.5) * t * t;
    const real z = moved + next.fall; /* as if it did not fall */
    next.all.n11 = fit.all.n11 + REAL(1.0);
    next.all.n12 = fit.all.n12 + q;
    next.all.n13 = fit.all.n13 + next.m;
    next.all.n22 = fit.all.n22 + q * q;
    next.all.n23 = fit.all.n23 + q * next.m;
    next.all.n33 = fit.all.n33 + next.m * next.m;
    next.all.b1 = fit.all.b1 + z;
    next.all.b2 = fit.all.b2 + q * z;
    next.all.b3 = fit.all.b3 + next.m * z;
    const real distance = dcmp_magnitude(moved);
    if (distance >= fit.farthest) {
        next.farthest = distance;
        next.out = next.all;
    }
    return next;
}

/* The gain that fits the way out best, beside a constant push and an error of the first position. */
static inline struct dcmp_motor_gain dcmp_fitted_gain(struct dcmp_gain_sums sums, struct dcmp_polarity_setup setup)
{
    const real counts = DCMP_NOISE_COUNTS * setup.count;
    const real variance = counts * counts + DCMP_NOISE_MIN * DCMP_NOISE_MIN;
    const real first = setup.count > DCMP_NOISE_MIN ? setup.count : DCMP_NOISE_MIN;
    const real usual = DCMP_GAIN_DEVIATION_RATIO * setup.ku;
    const real n11 = sums.n11 + variance / (first * first);
    const real n22 = sums.n22 + variance / (DCMP_DISTURBANCE_DEVIATION * DCMP_DISTURBANCE_DEVIATION);
    const real n33 = sums.n33 + variance / (usual * usual);
    const real l2 = sums.n12 / n11;
    const real l3 = sums.n13 / n11;
    const real d22 = n22 - l2 * sums.n12;
    const real d23 = sums.n23 - l2 * sums.n13;
    const real d33 = n33 - l3 * sums.n13;
    const real l = d23 / d22;
    const real d = d33 - l * d23;
    if (!(d > REAL(0.0))) { /* too large for sums: what was expected before a sample */
        const struct dcmp_motor_gain unknown = {REAL(0.0), usual};
        return unknown;
    }
    const real rest2 = sums.b2 - l2 * sums.b1;
    const real rest3 = sums.b3 - l3 * sums.b1;
    const struct dcmp_motor_gain found = {(rest3 - l * rest2) / d, dcmp_square_root(variance / d)};
    return found;
}

/* -------------------------------------------------------------------------------------------------- stages of the check */

enum dcmp_polarity_stage {
    DCMP_POLARITY_WATCH = 0,
    DCMP_POLARITY_UP = 1,
    DCMP_POLARITY_DOWN = 2,
    DCMP_POLARITY_OVER = 3 /* and all is well */
};

struct dcmp_polarity_check {
    enum dcmp_polarity_stage stage;
    bool began;
    bool found;      /* the gain was measured, well or not */
    int64_t since;   /* tick at which the stage began */
    real x0;         /* rad, where the arm was as watching, and then the pushes, began */
    real length;     /* s, of the first push */
    real rise;       /* s, that the voltage applied takes to get there */
    real voltage;    /* V, for the period of the last sample */
    real up;         /* rad, the way of the first push */
    real down;       /* rad, the way of the second */
    real reached;    /* V, either way, that was applied at most */
    struct dcmp_gain_fit fit;
    struct dcmp_motor_gain gain;
    struct dcmp_objection objection; /* of the last sample */
};

static inline struct dcmp_polarity_check dcmp_polarity_objects(struct dcmp_polarity_check now, int64_t tick,
                                                               enum dcmp_cause cause, real first, real second)
{
    struct dcmp_polarity_check next = now;
    const struct dcmp_objection objection = {tick, cause, first, second};
    next.objection = objection;
    return next;
}

static inline struct dcmp_polarity_check dcmp_polarity_watch(struct dcmp_polarity_check now,
                                                             struct dcmp_polarity_setup setup, int64_t tick,
                                                             real position, real since)
{
    const real moved = position - now.x0;
    if (!(dcmp_magnitude(moved) <= DCMP_REST_TRAVEL_MAX)) {
        return dcmp_polarity_objects(now, tick, DCMP_CAUSE_PROBE_MOVING, moved, since);
    }
    struct dcmp_polarity_check next = now;
    if (since >= DCMP_REST_TIME) {
        next.since = tick;
        next.x0 = position;
        next.fit = dcmp_gain_fit_add(now.fit, setup.gravity, REAL(0.0), REAL(0.0), REAL(0.0));
        next.stage = DCMP_POLARITY_UP;
        next.voltage = setup.voltage;
    }
    return next;
}

/* Take in a sample of a push, `since` the pushes began, s. */
static inline struct dcmp_polarity_check dcmp_polarity_seen(struct dcmp_polarity_check now,
                                                            struct dcmp_polarity_setup setup, real since, real moved,
                                                            real voltage)
{
    const real size = dcmp_magnitude(voltage);
    struct dcmp_polarity_check next = now;
    next.fit = dcmp_gain_fit_add(now.fit, setup.gravity, since, moved, voltage);
    next.reached = size > now.reached ? size : now.reached;
    return next;
}

static inline struct dcmp_polarity_check dcmp_polarity_push_up(struct dcmp_polarity_check now,
                                                               struct dcmp_polarity_setup setup, int64_t tick,
                                                               real moved, real voltage, real since)
{
    struct dcmp_polarity_check next = dcmp_polarity_seen(now, setup, since, moved, voltage);
    const real distance = dcmp_magnitude(moved);
    if (!(dcmp_magnitude(voltage) >= DCMP_VOLTAGE_RISEN_SHARE * setup.voltage)) {
        next.rise = since;
    }
    const real coasting =
        since > REAL(0.0) ? DCMP_COASTING_SPEED_RATIO * distance / since * next.rise : REAL(0.0);
    if (!(since < DCMP_PUSH_TIME_MAX && distance < DCMP_PUSH_TRAVEL_MAX &&
          distance + coasting < DCMP_COASTING_TRAVEL_MAX)) {
        next.up = moved;
        next.length = since;
        next.since = tick;
        next.stage = DCMP_POLARITY_DOWN;
        next.voltage = -setup.voltage;
    }
    return next;
}

/* What the measured gain objects to; an encoder's step is given the benefit. */
static inline enum dcmp_cause dcmp_polarity_cause(struct dcmp_polarity_check now, struct dcmp_polarity_setup setup)
{
    const real unsure = DCMP_SIGNIFICANCE_DEVIATIONS * now.gain.deviation;
    const real least = now.gain.gain - unsure;
    const real most = now.gain.gain + unsure;
    const bool still = !(now.fit.farthest > setup.count);
    const bool unclear = !(least > REAL(0.0)) && most > REAL(0.0);
    if ((still || unclear) && !(now.reached >= DCMP_VOLTAGE_SHARE_MIN * setup.voltage)) {
        return DCMP_CAUSE_PROBE_SLEW;
    }
    if (still) {
        return DCMP_CAUSE_PROBE_POWER;
    }
    if (!(most > REAL(0.0))) {
        return DCMP_CAUSE_PROBE_POLARITY;
    }
    if (unclear) {
        return DCMP_CAUSE_PROBE_UNSURE;
    }
    if (!(most > setup.ku / DCMP_GAIN_RATIO_MAX && least < setup.ku * DCMP_GAIN_RATIO_MAX)) {
        return DCMP_CAUSE_PROBE_GAIN;
    }
    return DCMP_CAUSE_NONE;
}

static inline struct dcmp_polarity_check dcmp_polarity_push_down(struct dcmp_polarity_check now,
                                                                 struct dcmp_polarity_setup setup, int64_t tick,
                                                                 real moved, real voltage, real since)
{
    struct dcmp_polarity_check next = dcmp_polarity_seen(now, setup, now.length + since, moved, voltage);
    if (since < now.length && dcmp_magnitude(moved) < DCMP_RETURN_TRAVEL_MAX) {
        return next;
    }
    next.down = moved - now.up;
    next.gain = dcmp_fitted_gain(next.fit.out, setup);
    next.found = true;
    const enum dcmp_cause cause = dcmp_polarity_cause(next, setup);
    if (cause == DCMP_CAUSE_NONE) {
        next.stage = DCMP_POLARITY_OVER;
        return next;
    }
    if (cause == DCMP_CAUSE_PROBE_SLEW) {
        return dcmp_polarity_objects(next, tick, cause, next.reached, next.length);
    }
    return dcmp_polarity_objects(next, tick, cause, next.up, next.down);
}

/* Judge a sample: its tick, position, rad, and the voltage applied in the period before, V. After the one that ends the
 * check, or an objection, none is judged. */
static inline struct dcmp_polarity_check dcmp_polarity_check(struct dcmp_polarity_check before,
                                                             struct dcmp_polarity_setup setup, int64_t tick,
                                                             real position, real voltage, real period)
{
    const struct dcmp_objection none = {0, DCMP_CAUSE_NONE, REAL(0.0), REAL(0.0)};
    struct dcmp_polarity_check now = before;
    now.objection = none;
    const real sum = dcmp_instant(tick, period) + position + voltage;
    if (!dcmp_is_finite(sum)) {
        return dcmp_polarity_objects(now, tick, DCMP_CAUSE_PROBE_NUMBERS, position, voltage);
    }
    if (!now.began) {
        now.began = true;
        now.since = tick;
        now.x0 = position;
    }
    const real since = dcmp_elapsed(now.since, tick, period);
    if (now.stage == DCMP_POLARITY_WATCH) {
        return dcmp_polarity_watch(now, setup, tick, position, since);
    }
    if (now.stage == DCMP_POLARITY_UP) {
        return dcmp_polarity_push_up(now, setup, tick, position - now.x0, voltage, since);
    }
    return dcmp_polarity_push_down(now, setup, tick, position - now.x0, voltage, since);
}

#endif
