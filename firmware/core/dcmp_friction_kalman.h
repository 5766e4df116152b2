/* The observer that knows Coulomb friction, dcmp_hil/control/observers/friction_kalman, one sample a call:
 * predict with friction, measure by edges, judge the innovation, correct. The Python modules say why; the operations and
 * their order are theirs, so that both give the same bits. */
#ifndef DCMP_FRICTION_KALMAN_H
#define DCMP_FRICTION_KALMAN_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_control.h"

/* What a rig makes of its settings; computed once, by the host. */
struct dcmp_friction_setup {
    real f0;                 /* 1/s */
    real gravity;            /* rad/s2 */
    real ku;                 /* (rad/s2)/V */
    real f1;                 /* rad/s2 */
    real f_max;              /* rad/s2 */
    real f1_variance;        /* (rad/s2)2 */
    real q;                  /* rad, one count */
    real half_count;         /* rad */
    real restart_after;      /* s */
    real unchanged_variance; /* rad2, of a count that did not change */
    real edge_variance;      /* rad2 */
    real d_noise;            /* (rad/s2)2/s */
};

/* The state, and what the last step was. */
struct dcmp_motion {
    real x1;        /* rad */
    real x2;        /* rad/s */
    real d;         /* rad/s2, the disturbance without gravity and friction */
    real f;         /* rad/s2, the level of Coulomb friction */
    real s;         /* rad/s3, the slope of d */
    real a;         /* rad/s2, the acceleration without Coulomb friction */
    real direction; /* of the motion, -1 or 1, and 0 where the arm sticks */
};

/* The covariance of (x1, x2, d, f, s): its upper triangle. */
struct dcmp_covariance {
    real p00;
    real p01;
    real p02;
    real p03;
    real p04;
    real p11;
    real p12;
    real p13;
    real p14;
    real p22;
    real p23;
    real p24;
    real p33;
    real p34;
    real p44;
};

/* The variance that a step adds to disturbance, friction and slope. */
struct dcmp_noise {
    real d;
    real f;
    real s;
};

/* How far the model is believed: see trust.py. */
struct dcmp_trust {
    real m;
    real slope_m;
    real calm;
    real slow;
    real fast;
    real scatter;
};

/* An innovation, rad; H = (1, h, 0, 0, 0), h in s; its variance, rad2; whether the count changed. */
struct dcmp_measured {
    real e;
    real h;
    real r;
    bool edge;
};

struct dcmp_friction_kalman {
    struct dcmp_motion state;
    struct dcmp_covariance covariance;
    struct dcmp_trust trust;
    struct dcmp_estimate estimate;
    real y;         /* rad, of the last sample */
    real first;     /* rad, at the start */
    real count;     /* a whole number */
    uint32_t steps; /* of the disturbance, that were assumed since the start */
    bool sticks;
    bool edge;      /* the last sample passed one, or was the first */
};

/* When a sample comes. Differences only: the filter's owner has the clock, in ticks where seconds are not exact. */
struct dcmp_friction_times {
    real step; /* s, since the last sample; 0 or less where there is none */
    real edge; /* s, since the last sample that passed an edge */
};

#define DCMP_SLOPE_LEAK REAL(0.3)         /* 1/s */
#define DCMP_STUCK_VARIANCE REAL(1e-5)    /* (rad/s)2 */
#define DCMP_CREEP REAL(1e-6)             /* rad2/s */
#define DCMP_VELOCITY_NOISE REAL(3e-6)    /* (rad/s)2/s */
#define DCMP_VELOCITY_VARIANCE REAL(1e-8) /* at the start */
#define DCMP_DISTURBANCE_VARIANCE REAL(1.0)
#define DCMP_SLOPE_VARIANCE REAL(9.0)
#define DCMP_SLOPE_NOISE REAL(5.0)
#define DCMP_FRICTION_NOISE REAL(1e-3)
#define DCMP_REVERSAL_NOISE REAL(1.0)
#define DCMP_REVERSAL REAL(0.06)       /* rad/s */
#define DCMP_RELEASE_GATE REAL(9.0)    /* variances */
#define DCMP_STEP_AGE REAL(0.025)      /* s */
#define DCMP_STEP_VARIANCE_MAX REAL(90000.0)
#define DCMP_STEP_CALM_MAX REAL(2.5)
#define DCMP_STEP_SPEED_MIN REAL(0.1)  /* rad/s */
#define DCMP_STEP_CHI2 REAL(30.0)
#define DCMP_SLOW_RATE REAL(0.04)      /* of a mean, per innovation */
#define DCMP_SLOW_WEIGHT REAL(49.0)
#define DCMP_FAST_RATE REAL(0.2)
#define DCMP_FAST_WEIGHT REAL(9.0)
#define DCMP_CLIP REAL(4.0)            /* standard deviations */
#define DCMP_DECAY REAL(0.04)          /* s */
#define DCMP_INFLATION_MAX REAL(300.0)
#define DCMP_SLOPE_INFLATION_MAX REAL(100.0)
#define DCMP_CALM REAL(0.3)            /* s */
#define DCMP_CALM_STEP_MAX REAL(50.0)
#define DCMP_SCATTER_RATE REAL(0.02)
#define DCMP_SCATTER_MEAN REAL(1.5)
#define DCMP_SCATTER_MAX REAL(30.0)
#define DCMP_SCATTER_CLIP REAL(9.0)
#define DCMP_SCATTER_INFLATION_MAX REAL(10.0)
#define DCMP_FRICTION_CROSSING REAL(0.001) /* rad/s of the reference */

/* ------------------------------------------------------------------------------------------------------------- motion */

static inline struct dcmp_motion dcmp_at_rest(struct dcmp_motion now)
{
    struct dcmp_motion next = now;
    next.x2 = REAL(0.0);
    next.direction = REAL(0.0);
    return next;
}

/* An arm that came to rest inside the step: it sticks there, or turns. */
static inline struct dcmp_motion dcmp_came_to_rest(struct dcmp_motion now, real net, real step, real f0)
{
    const real stopped_after = -now.x2 / net;
    struct dcmp_motion next = now;
    next.x1 = now.x1 + REAL(0.5) * now.x2 * stopped_after;
    next.a = now.a + f0 * now.x2;
    if (dcmp_magnitude(next.a) <= next.f) {
        return dcmp_at_rest(next);
    }
    next.direction = next.a < REAL(0.0) ? REAL(-1.0) : REAL(1.0);
    const real left = step - stopped_after;
    next.x2 = left * (next.a - next.direction * next.f);
    next.x1 = next.x1 + REAL(0.5) * left * next.x2;
    return next;
}

/* The sign of what moves: the velocity, or from rest the acceleration beyond friction. */
static inline real dcmp_direction(real x2, real a, real f)
{
    if (x2 > REAL(0.0) || x2 < REAL(0.0)) {
        return x2 > REAL(0.0) ? REAL(1.0) : REAL(-1.0);
    }
    if (a > f) {
        return REAL(1.0);
    }
    return a < -f ? REAL(-1.0) : REAL(0.0);
}

/* One step of x1'' = -f0 x2 - f sgn x2 + d - g sin x1 + u, d' = s; friction is a set. */
static inline struct dcmp_motion dcmp_moved(struct dcmp_motion now, real step, real u, real f0, real gravity)
{
    struct dcmp_motion next = now;
    next.d = now.d + step * now.s;
    next.s = now.s * (REAL(1.0) - DCMP_SLOPE_LEAK * step);
    next.a = next.d - gravity * dcmp_sine(now.x1 + REAL(0.5) * step * now.x2) + u - f0 * now.x2;
    next.direction = dcmp_direction(now.x2, next.a, now.f);
    if (next.direction == REAL(0.0)) {
        return dcmp_at_rest(next);
    }
    const real net = next.a - next.direction * now.f;
    const real v = now.x2 + step * net;
    if (v * next.direction > REAL(0.0) || now.x2 == REAL(0.0)) {
        next.x1 = now.x1 + REAL(0.5) * step * (now.x2 + v);
        next.x2 = v;
        return next;
    }
    return dcmp_came_to_rest(next, net, step, f0);
}

/* --------------------------------------------------------------------------------------------------------- covariance */

/* What both kinds of step do to the slope's row, and to the disturbance by it. */
static inline struct dcmp_covariance dcmp_slope_decayed(struct dcmp_covariance p, real step, struct dcmp_noise noise)
{
    const real kept = REAL(1.0) - DCMP_SLOPE_LEAK * step;
    struct dcmp_covariance next = p;
    next.p04 = p.p04 * kept;
    next.p14 = p.p14 * kept;
    next.p24 = p.p24 * kept;
    next.p34 = p.p34 * kept;
    next.p44 = p.p44 * (kept * kept);
    next.p22 = p.p22 + (step * (REAL(2.0) * next.p24 + step * next.p44) + noise.d);
    next.p02 = p.p02 + step * next.p04;
    next.p12 = p.p12 + step * next.p14;
    next.p23 = p.p23 + step * next.p34;
    next.p24 = next.p24 + step * next.p44;
    next.p33 = p.p33 + noise.f;
    next.p44 = next.p44 + noise.s;
    return next;
}

/* After a step in which the arm moved; x1 and direction are those at its end. */
static inline struct dcmp_covariance dcmp_slipped(struct dcmp_covariance p, struct dcmp_motion end, real step, real f0,
                                                  real gravity, struct dcmp_noise noise)
{
    const real b0 = -step * gravity * dcmp_cosine(end.x1);
    const real b1 = REAL(1.0) - f0 * step;
    const real b3 = -end.direction * step;
    const real half = REAL(0.5) * step;
    const real c = half * (REAL(1.0) + f0 * step);
    const real h0 = b0 * p.p00 + b1 * p.p01 + step * p.p02 + b3 * p.p03;
    const real h1 = b0 * p.p01 + b1 * p.p11 + step * p.p12 + b3 * p.p13;
    const real h2 = b0 * p.p02 + b1 * p.p12 + step * p.p22 + b3 * p.p23;
    const real h3 = b0 * p.p03 + b1 * p.p13 + step * p.p23 + b3 * p.p33;
    const real h4 = b0 * p.p04 + b1 * p.p14 + step * p.p24 + b3 * p.p34;
    struct dcmp_covariance next = p;
    next.p02 = p.p02 + c * p.p12 + half * h2;
    next.p03 = p.p03 + c * p.p13 + half * h3;
    next.p04 = p.p04 + c * p.p14 + half * h4;
    next.p12 = h2;
    next.p13 = h3;
    next.p14 = h4;
    const real g0 = p.p00 + c * p.p01 + half * h0;
    const real g1 = p.p01 + c * p.p11 + half * h1;
    next.p01 = b0 * g0 + b1 * g1 + step * next.p02 + b3 * next.p03;
    next.p11 = b0 * h0 + b1 * h1 + step * h2 + b3 * h3 + DCMP_VELOCITY_NOISE * step;
    next.p00 = g0 + c * g1 + half * next.p01;
    return dcmp_slope_decayed(next, step, noise);
}

/* After a step in which the arm stuck: its velocity is 0, and it creeps. */
static inline struct dcmp_covariance dcmp_stuck(struct dcmp_covariance p, real step, struct dcmp_noise noise)
{
    struct dcmp_covariance next = dcmp_slope_decayed(p, step, noise);
    next.p00 = p.p00 + DCMP_CREEP * step;
    next.p01 = REAL(0.0);
    next.p11 = DCMP_STUCK_VARIANCE;
    next.p12 = REAL(0.0);
    next.p13 = REAL(0.0);
    next.p14 = REAL(0.0);
    return next;
}

/* Of an arm that stuck and was seen to move. */
static inline struct dcmp_covariance dcmp_released(struct dcmp_covariance p, real error, real x2, real friction)
{
    struct dcmp_covariance next = p;
    next.p00 = p.p00 + error * error;
    next.p11 = x2 * x2;
    next.p22 = p.p22 + friction * friction;
    return next;
}

/* P + variance v v', v = (age^2/2, age, 1): the disturbance stepped `age` s ago. */
static inline struct dcmp_covariance dcmp_widened(struct dcmp_covariance p, real age, real variance)
{
    const real v0 = REAL(0.5) * age * age;
    struct dcmp_covariance next = p;
    next.p00 = p.p00 + variance * v0 * v0;
    next.p01 = p.p01 + variance * v0 * age;
    next.p02 = p.p02 + variance * v0;
    next.p11 = p.p11 + variance * age * age;
    next.p12 = p.p12 + variance * age;
    next.p22 = p.p22 + variance;
    return next;
}

static inline real dcmp_innovation_variance(struct dcmp_covariance p, struct dcmp_measured measured)
{
    return p.p00 + measured.h * (REAL(2.0) * p.p01 + measured.h * p.p11) + measured.r;
}

/* P so wide that a step of the disturbance, a while ago, explains the innovation. */
static inline struct dcmp_covariance dcmp_explained(struct dcmp_covariance p, struct dcmp_measured measured,
                                                    real variance)
{
    const real half = REAL(0.5) * DCMP_STEP_AGE * DCMP_STEP_AGE;
    const real early = half + measured.h * DCMP_STEP_AGE;
    const real late = REAL(0.5) * half;
    const real seen = late > early ? late : early;
    const real most = (measured.e * measured.e - variance) / (seen * seen);
    return dcmp_widened(p, DCMP_STEP_AGE, DCMP_STEP_VARIANCE_MAX < most ? DCMP_STEP_VARIANCE_MAX : most);
}

/* -------------------------------------------------------------------------------------------------------------- trust */

/* The mean of m over 0.3 s, a step later. */
static inline real dcmp_calm(real calm, real m, real step)
{
    const real up = m < calm + DCMP_CALM_STEP_MAX ? m - calm : DCMP_CALM_STEP_MAX;
    return calm + up * step / DCMP_CALM;
}

static inline real dcmp_decayed(real m, real target, real step)
{
    return target + (m - target) * dcmp_exp(-step / DCMP_DECAY);
}

static inline real dcmp_scatter(real scatter, real square)
{
    const real clipped = DCMP_SCATTER_CLIP < square ? DCMP_SCATTER_CLIP : square;
    const real grown = scatter * (REAL(1.0) + DCMP_SCATTER_RATE * (clipped - DCMP_SCATTER_MEAN));
    const real most = DCMP_SCATTER_MAX < grown ? DCMP_SCATTER_MAX : grown;
    return most > REAL(1.0) ? most : REAL(1.0);
}

/* At the end of a step with an innovation of nu standard deviations. */
static inline struct dcmp_trust dcmp_judged(struct dcmp_trust trust, real nu, real step, bool edge)
{
    const real square = nu * nu;
    struct dcmp_trust next = trust;
    if (edge && trust.m < DCMP_SCATTER_INFLATION_MAX) {
        next.scatter = dcmp_scatter(trust.scatter, square);
    }
    const real signed_clip = nu < REAL(0.0) ? -DCMP_CLIP : DCMP_CLIP;
    const real clipped = square > DCMP_CLIP * DCMP_CLIP ? signed_clip : nu;
    next.slow = trust.slow + DCMP_SLOW_RATE * (clipped - trust.slow);
    next.fast = trust.fast + DCMP_FAST_RATE * (clipped - trust.fast);
    const real z = REAL(0.5) * DCMP_SLOW_WEIGHT * next.slow * next.slow;
    const real target = z > REAL(1.0) ? z * z : REAL(1.0);
    next.slope_m = DCMP_SLOPE_INFLATION_MAX < target ? DCMP_SLOPE_INFLATION_MAX : target;
    if (target > trust.m) {
        next.m = DCMP_INFLATION_MAX < target ? DCMP_INFLATION_MAX : target;
    } else if (trust.m != REAL(1.0)) {
        next.m = dcmp_decayed(trust.m, target, step);
    } else {
        next.m = trust.m;
    }
    next.calm = dcmp_calm(trust.calm, next.m, step);
    return next;
}

/* At the end of a step without an innovation. */
static inline struct dcmp_trust dcmp_calmed(struct dcmp_trust trust, real step)
{
    struct dcmp_trust next = trust;
    if (trust.m != REAL(1.0)) {
        next.m = dcmp_decayed(trust.m, REAL(1.0), step);
    }
    next.calm = dcmp_calm(trust.calm, next.m, step);
    return next;
}

/* Whether the innovations of late are large enough, and of the sign of nu, for a step of the disturbance. */
static inline bool dcmp_stepped(real fast, real nu)
{
    return DCMP_FAST_WEIGHT * fast * fast > DCMP_STEP_CHI2 && nu * fast > REAL(0.0) && nu * nu > REAL(1.0);
}

/* ------------------------------------------------------------------------------------------------------------- filter */

static inline struct dcmp_covariance dcmp_updated(struct dcmp_covariance p, const real gain[5], const real column[5])
{
    const struct dcmp_covariance next = {
        p.p00 - gain[0] * column[0], p.p01 - gain[0] * column[1], p.p02 - gain[0] * column[2],
        p.p03 - gain[0] * column[3], p.p04 - gain[0] * column[4], p.p11 - gain[1] * column[1],
        p.p12 - gain[1] * column[2], p.p13 - gain[1] * column[3], p.p14 - gain[1] * column[4],
        p.p22 - gain[2] * column[2], p.p23 - gain[2] * column[3], p.p24 - gain[2] * column[4],
        p.p33 - gain[3] * column[3], p.p34 - gain[3] * column[4], p.p44 - gain[4] * column[4],
    };
    return next;
}

/* Judge an innovation, and correct by it. */
static inline struct dcmp_friction_kalman dcmp_corrected(struct dcmp_friction_kalman filter,
                                                         struct dcmp_friction_setup setup,
                                                         struct dcmp_measured measured, real step)
{
    struct dcmp_friction_kalman next = filter;
    struct dcmp_covariance p = filter.covariance;
    real variance = dcmp_innovation_variance(p, measured);
    const real nu = measured.e / dcmp_square_root(variance);
    next.trust = dcmp_judged(filter.trust, nu, step, measured.edge);
    if (dcmp_stepped(next.trust.fast, nu) && filter.trust.calm < DCMP_STEP_CALM_MAX &&
        dcmp_magnitude(filter.state.x2) >= DCMP_STEP_SPEED_MIN) {
        p = dcmp_explained(p, measured, variance);
        next.trust.fast = REAL(0.5) * next.trust.fast;
        variance = dcmp_innovation_variance(p, measured);
        next.steps = filter.steps + 1u;
    }
    const real column[5] = {p.p00 + measured.h * p.p01, p.p01 + measured.h * p.p11, p.p02 + measured.h * p.p12,
                            p.p03 + measured.h * p.p13, p.p04 + measured.h * p.p14};
    const real gain[5] = {column[0] / variance, column[1] / variance, column[2] / variance, column[3] / variance,
                          column[4] / variance};
    next.covariance = dcmp_updated(p, gain, column);
    next.state.x1 = filter.state.x1 + gain[0] * measured.e;
    next.state.x2 = filter.state.x2 + gain[1] * measured.e;
    next.state.d = filter.state.d + gain[2] * measured.e;
    next.state.s = filter.state.s + gain[4] * measured.e;
    const real f = filter.state.f + gain[3] * measured.e;
    const real at_most = setup.f_max < f ? setup.f_max : f;
    next.state.f = at_most > REAL(0.0) ? at_most : REAL(0.0);
    return next;
}

/* Measure by the newest edge that was passed; an arm that stuck is released by it. */
static inline struct dcmp_friction_kalman dcmp_by_edge(struct dcmp_friction_kalman filter,
                                                       struct dcmp_friction_setup setup, real rise,
                                                       struct dcmp_friction_times times)
{
    struct dcmp_friction_kalman next = filter;
    const real step = times.step;
    const real x2 = filter.state.x2;
    const real speed = dcmp_magnitude(x2);
    const real span = speed * step > setup.q ? setup.q / speed : step;
    const real passed = filter.y - (rise > REAL(0.0) ? setup.half_count : -setup.half_count);
    const real e = passed - filter.state.x1 + REAL(0.5) * span * x2;
    const real travel = x2 * span;
    const struct dcmp_measured measured = {
        e, REAL(-0.5) * span, filter.trust.scatter * setup.edge_variance + travel * travel / REAL(12.0), true};
    next.edge = true;
    if (filter.sticks && e * e > DCMP_RELEASE_GATE * (filter.covariance.p00 + measured.r)) {
        const real shortest = REAL(2.0) * step;
        next.sticks = false;
        next.state.d = (e < REAL(0.0) ? -filter.state.f : filter.state.f) - (filter.state.a - filter.state.d);
        next.state.x2 = REAL(0.5) * e / (shortest > times.edge ? shortest : times.edge);
        next.covariance = dcmp_released(filter.covariance, e, next.state.x2, filter.state.f);
    }
    return dcmp_corrected(next, setup, measured, step);
}

static inline struct dcmp_noise dcmp_friction_noise(struct dcmp_trust trust, real x2, real step, real d_noise)
{
    struct dcmp_noise noise = {d_noise * step * trust.m, DCMP_FRICTION_NOISE * step,
                               DCMP_SLOPE_NOISE * step * trust.slope_m};
    if (-DCMP_REVERSAL < x2 && x2 < DCMP_REVERSAL) {
        noise.d = noise.d + DCMP_REVERSAL_NOISE * step;
        noise.f = noise.f * (REAL(30.0) * trust.m - REAL(29.0));
    }
    return noise;
}

/* Begin at rest where the arm is, as if nothing had been seen before. */
static inline struct dcmp_friction_kalman dcmp_friction_begin(struct dcmp_friction_setup setup, real y)
{
    const struct dcmp_friction_kalman first = {
        .state = {.x1 = y, .f = setup.f1},
        .covariance = {.p00 = setup.q * setup.q / REAL(12.0),
                       .p11 = DCMP_VELOCITY_VARIANCE,
                       .p22 = DCMP_DISTURBANCE_VARIANCE,
                       .p33 = setup.f1_variance,
                       .p44 = DCMP_SLOPE_VARIANCE},
        .trust = {.m = REAL(1.0), .slope_m = REAL(1.0), .scatter = REAL(1.0)},
        .estimate = {.position = y},
        .y = y,
        .first = y,
        .edge = true,
    };
    return first;
}

/* Estimate no number from here on: one that came was not finite. */
static inline struct dcmp_friction_kalman dcmp_friction_lose(struct dcmp_friction_kalman filter, real none)
{
    struct dcmp_friction_kalman next = filter;
    const struct dcmp_motion lost = {none, none, none, none, none, none, none};
    const struct dcmp_estimate no_estimate = {none, none, none};
    next.edge = false;
    next.state = lost;
    next.estimate = no_estimate;
    return next;
}

/* Correct the prediction by a count that rose, or by one that stayed where the state says that it left. */
static inline struct dcmp_friction_kalman dcmp_friction_measure(struct dcmp_friction_kalman filter,
                                                                struct dcmp_friction_setup setup, real y,
                                                                struct dcmp_friction_times times)
{
    struct dcmp_friction_kalman next = filter;
    const real off = y - filter.state.x1;
    real rise = REAL(0.0);
    if (y != filter.y) {
        const real counts = (y - filter.first) / setup.q;
        next.count = dcmp_magnitude(counts) < DCMP_WHOLE ? dcmp_nearest(counts) : counts;
        rise = next.count - filter.count;
    }
    next.y = y;
    if (rise != REAL(0.0)) {
        return dcmp_by_edge(next, setup, rise, times);
    }
    if (off > setup.half_count || off < -setup.half_count) {
        const real bound = off < REAL(0.0) ? -setup.half_count : setup.half_count;
        const struct dcmp_measured measured = {off - bound, REAL(0.0), filter.trust.scatter * setup.unchanged_variance,
                                               false};
        return dcmp_corrected(next, setup, measured, times.step);
    }
    next.trust = dcmp_calmed(filter.trust, times.step);
    return next;
}

/* Advance to the next sample over the voltage really applied, V, and correct by its count, y in rad. Time has to advance. */
static inline struct dcmp_friction_kalman dcmp_friction_kalman_update(struct dcmp_friction_kalman filter,
                                                                      struct dcmp_friction_setup setup,
                                                                      struct dcmp_friction_times times, real y,
                                                                      real voltage)
{
    const real step = times.step;
    if (!(step > REAL(0.0) && step <= setup.restart_after)) {
        return dcmp_friction_begin(setup, y);
    }
    const real none = (filter.state.x1 + filter.state.x2 + y + voltage) * REAL(0.0);
    if (none != REAL(0.0)) {
        return dcmp_friction_lose(filter, none);
    }
    const real u = setup.ku * voltage;
    struct dcmp_friction_kalman next = filter;
    next.edge = false;
    next.state = dcmp_moved(filter.state, step, u, setup.f0, setup.gravity);
    next.sticks = next.state.direction == REAL(0.0);
    const struct dcmp_noise noise = dcmp_friction_noise(filter.trust, next.state.x2, step, setup.d_noise);
    next.covariance = next.sticks ? dcmp_stuck(filter.covariance, step, noise)
                                  : dcmp_slipped(filter.covariance, next.state, step, setup.f0, setup.gravity, noise);
    next = dcmp_friction_measure(next, setup, y, times);
    const real x2 = next.state.x2;
    const real friction = x2 > REAL(0.0) ? next.state.f : -next.state.f;
    const real moving = next.state.d - setup.gravity * dcmp_sine(next.state.x1) - friction;
    const struct dcmp_estimate estimate = {next.state.x1, x2, x2 != REAL(0.0) ? moving : -u};
    next.estimate = estimate;
    return next;
}

/* The state at the instant at which a command acts, with the friction that will act then: after `step`, s, under the voltage
 * that is under way, V, or where it is. `velocity` is the reference's, rad/s. */
static inline struct dcmp_estimate dcmp_friction_ahead(struct dcmp_friction_kalman filter,
                                                       struct dcmp_friction_setup setup, bool delayed, real step,
                                                       real voltage, real velocity)
{
    struct dcmp_motion at = filter.state;
    if (delayed) {
        at = dcmp_moved(at, step, setup.ku * voltage, setup.f0, setup.gravity);
    }
    const real ratio = velocity / DCMP_FRICTION_CROSSING;
    const real at_most = REAL(1.0) < ratio ? REAL(1.0) : ratio;
    const real direction = ratio < REAL(-1.0) ? REAL(-1.0) : at_most;
    const real w = at.d - setup.gravity * dcmp_sine(at.x1) - filter.state.f * direction;
    const struct dcmp_estimate ahead = {at.x1, at.x2, w};
    return ahead;
}

#endif
