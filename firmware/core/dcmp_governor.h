/* The reference governor: a reference passes unchanged while the arm can follow it inside its limits; where it cannot, the
 * arm is led by a motion of its own. dcmp_hil/safety/reference_governor.py has the same operations in the same order, and
 * says why they are these. A state of zeros is the one before the first reference. */
#ifndef DCMP_GOVERNOR_H
#define DCMP_GOVERNOR_H

#include <stdbool.h>
#include <stdint.h>

#include "dcmp_control.h"
#include "dcmp_time.h"

#define DCMP_MOVING_ACCELERATION_SHARE REAL(0.8)   /* of the acceleration, between stops */
#define DCMP_APPROACH_ACCELERATION_SHARE REAL(0.5) /* of the acceleration, that the way to a position is laid out for */
#define DCMP_MOVING_VELOCITY_SHARE REAL(0.8)       /* of the largest velocity, between stops */
#define DCMP_PULL REAL(5.0)                        /* 1/s, of a small distance */
#define DCMP_DAMPING REAL(15.0)                    /* 1/s, of the velocity */
#define DCMP_ACCELERATION_LAG REAL(0.02)           /* s, over which its own acceleration changes */
#define DCMP_JOIN_POSITION REAL(5e-4)              /* rad: so close it goes over into the reference */
#define DCMP_JOIN_VELOCITY REAL(0.02)              /* rad/s */
#define DCMP_JOIN_ACCELERATION REAL(2.0)           /* rad/s2 */
#define DCMP_JUMP_MAX REAL(2.0)                    /* rad, that is not governed */
#define DCMP_OVERSHOOT_SHARE REAL(0.4)             /* of a jump, by which the arm may go beyond it */
#define DCMP_JUMP_GAIN_RATIO_MAX REAL(1.5)         /* times the believed motor gain */
#define DCMP_JUMP_INTERVAL_MIN REAL(0.5)           /* s */
#define DCMP_GOVERNOR_GAP_MAX REAL(0.1)            /* s */
#define DCMP_INTEGRATION_STEP REAL(2e-3)           /* s */

/* Largest position, velocity and acceleration of a reference, either way; all finite but the last. */
struct dcmp_bounds {
    real position;     /* rad */
    real velocity;     /* rad/s */
    real acceleration; /* rad/s2 */
    real braking;      /* rad/s2, of a stop, and of its own motion */
    real stop;         /* s2/rad, way that a stop takes over the square of the velocity; the host computes it */
    real strongest;    /* rad/s2, of the motor at full voltage; infinity without a limit */
};

struct dcmp_governor {
    int64_t tick;   /* of the last reference, if there was one */
    int64_t jumped; /* tick of the last jump that was left to the controller, if there was one */
    struct dcmp_reference last; /* returned last, if there was one inside the bounds */
    bool began;
    bool has_jumped;
    bool has_last;
    bool leads; /* the last reference returned was its own */
};

/* The reference allowed; `own` says that it is not the one asked for. */
struct dcmp_governed {
    struct dcmp_governor next;
    struct dcmp_reference reference;
    bool own;
};

/* x, or the nearest number that is not beyond `most` either way; NaN of NaN. */
static inline real dcmp_within(real x, real most)
{
    const real raised = -most > x ? -most : x;
    return most < raised ? most : raised;
}

/* `size`, with the sign of x. */
static inline real dcmp_signed(real size, real x)
{
    return x < REAL(0.0) ? -size : size;
}

/* Every part is a number, and not infinite. */
static inline bool dcmp_finite_reference(struct dcmp_reference asked)
{
    const real sum = asked.position + asked.velocity + asked.acceleration;
    return dcmp_is_finite(sum);
}

static inline bool dcmp_inside(struct dcmp_reference asked, struct dcmp_bounds bounds)
{
    return dcmp_magnitude(asked.position) <= bounds.position && dcmp_magnitude(asked.velocity) <= bounds.velocity &&
           dcmp_magnitude(asked.acceleration) <= bounds.acceleration;
}

/* Where the arm would stand, rad, if it began to stop now. */
static inline real dcmp_stopped_at(struct dcmp_reference now, struct dcmp_bounds bounds)
{
    return now.position + bounds.stop * now.velocity * dcmp_magnitude(now.velocity);
}

/* Inside the bounds, and able to stop there. */
static inline bool dcmp_allowed(struct dcmp_reference asked, struct dcmp_bounds bounds)
{
    return dcmp_inside(asked, bounds) && dcmp_magnitude(dcmp_stopped_at(asked, bounds)) <= bounds.position;
}

/* A jump of this size, rad, is no longer and no faster than one may be. */
static inline bool dcmp_short_jump(real size, struct dcmp_bounds bounds)
{
    const bool known = dcmp_is_finite(bounds.strongest);
    const real fastest =
        known ? dcmp_square_root(DCMP_JUMP_GAIN_RATIO_MAX * bounds.strongest * size) : REAL(0.0);
    return size <= DCMP_JUMP_MAX && fastest <= bounds.velocity;
}

/* A reference that jumps to `target`, rad, may be left to the controller, now and then. */
static inline bool dcmp_may_jump(struct dcmp_governor now, struct dcmp_bounds bounds, real target, real period)
{
    const real size = dcmp_magnitude(target - now.last.position);
    if (!(dcmp_short_jump(size, bounds) &&
          dcmp_magnitude(target) + DCMP_OVERSHOOT_SHARE * size <= bounds.position)) {
        return false;
    }
    return !now.has_jumped || dcmp_elapsed(now.jumped, now.tick, period) >= DCMP_JUMP_INTERVAL_MIN;
}

/* The own motion has met the reference: it can take over. */
static inline bool dcmp_met(struct dcmp_reference own, struct dcmp_reference asked, struct dcmp_bounds bounds)
{
    const bool near = dcmp_magnitude(asked.position - own.position) <= DCMP_JOIN_POSITION &&
                      dcmp_magnitude(asked.velocity - own.velocity) <= DCMP_JOIN_VELOCITY &&
                      dcmp_magnitude(asked.acceleration - own.acceleration) <= DCMP_JOIN_ACCELERATION;
    return near && dcmp_allowed(asked, bounds);
}

/* The acceleration to aim at, rad/s2. */
static inline real dcmp_wanted_acceleration(struct dcmp_reference own, struct dcmp_bounds bounds,
                                            struct dcmp_reference target)
{
    const real rest = dcmp_stopped_at(own, bounds);
    const bool too_far = !(-bounds.position < rest && rest < bounds.position);
    if (too_far && own.position * own.velocity >= REAL(0.0) && own.velocity != REAL(0.0)) {
        return dcmp_signed(bounds.braking, -own.velocity);
    }
    const real easy = DCMP_APPROACH_ACCELERATION_SHARE * bounds.braking;
    const real left = target.position - own.position;
    const real near = easy / (DCMP_PULL * DCMP_PULL);
    real way = DCMP_PULL * left;
    if (dcmp_magnitude(left) > near) {
        way = dcmp_signed(dcmp_square_root(REAL(2.0) * easy * (dcmp_magnitude(left) - REAL(0.5) * near)), left);
    }
    way = dcmp_within(way + target.velocity, DCMP_MOVING_VELOCITY_SHARE * bounds.velocity);
    return dcmp_within(target.acceleration + DCMP_DAMPING * (way - own.velocity),
                       DCMP_MOVING_ACCELERATION_SHARE * bounds.braking);
}

/* Move on by `dt`, s, towards the target; `smooth` is what is left of an acceleration's difference after it. */
static inline struct dcmp_reference dcmp_lead(struct dcmp_reference own, struct dcmp_bounds bounds,
                                              struct dcmp_reference target, real dt, real smooth)
{
    const real wanted = dcmp_wanted_acceleration(own, bounds, target);
    const real a = wanted + smooth * (own.acceleration - wanted);
    struct dcmp_reference next = {own.position + dt * (own.velocity + REAL(0.5) * dt * a), own.velocity + dt * a, a};
    if (dcmp_magnitude(next.velocity) > bounds.velocity) {
        next.velocity = dcmp_signed(bounds.velocity, next.velocity);
        next.acceleration = REAL(0.0);
    }
    if (dcmp_magnitude(next.position) > bounds.position) {
        next.position = dcmp_signed(bounds.position, next.position);
        next.velocity = REAL(0.0);
        next.acceleration = REAL(0.0);
    }
    return next;
}

/* A reference passes unchanged. */
static inline struct dcmp_governed dcmp_passed(struct dcmp_governor next, struct dcmp_reference asked)
{
    struct dcmp_governed passed;
    passed.next = next;
    passed.reference = asked;
    passed.own = false;
    return passed;
}

/* Move on by `dt`, s, in steps of a few milliseconds, however long the period was. */
static inline struct dcmp_governed dcmp_led(struct dcmp_governor now, struct dcmp_bounds bounds,
                                            struct dcmp_reference asked, real dt)
{
    struct dcmp_governed led = dcmp_passed(now, asked);
    if (!dcmp_finite_reference(asked)) {
        return led;
    }
    if (dcmp_met(now.last, asked, bounds)) {
        led.next.leads = false;
        led.next.last = asked;
        return led;
    }
    const struct dcmp_reference at_bound = {dcmp_within(asked.position, bounds.position), REAL(0.0), REAL(0.0)};
    const struct dcmp_reference target = dcmp_inside(asked, bounds) ? asked : at_bound;
    const real gap = dt > DCMP_GOVERNOR_GAP_MAX ? DCMP_GOVERNOR_GAP_MAX : dt;
    const real needed = -dcmp_floor(-(gap / DCMP_INTEGRATION_STEP));
    const real steps = needed > REAL(1.0) ? needed : REAL(1.0);
    const real step = gap / steps;
    const real smooth = dcmp_exp(-step / DCMP_ACCELERATION_LAG);
    for (int32_t i = (int32_t)steps; i > 0; i--) {
        led.next.last = dcmp_lead(led.next.last, bounds, target, step, smooth);
    }
    led.reference = led.next.last;
    led.own = true;
    return led;
}

/* Begin to lead the arm from where the last reference was. */
static inline struct dcmp_governed dcmp_lead_on(struct dcmp_governor now, struct dcmp_bounds bounds,
                                                struct dcmp_reference asked, real dt)
{
    struct dcmp_governor from = now;
    if (dcmp_finite_reference(asked)) {
        if (!now.has_last) { /* no arm has been led yet */
            const struct dcmp_reference first = {dcmp_within(asked.position, bounds.position), REAL(0.0), REAL(0.0)};
            from.last = first;
            from.has_last = true;
        }
        from.leads = true;
    }
    return dcmp_led(from, bounds, asked, dt);
}

/* The reference for a tick, or what of it is possible; what is not finite stays. */
static inline struct dcmp_governed dcmp_governor_bound(struct dcmp_governor before, struct dcmp_bounds bounds,
                                                       struct dcmp_reference asked, int64_t tick, real period)
{
    const real dt = before.began ? dcmp_elapsed(before.tick, tick, period) : DCMP_GOVERNOR_GAP_MAX;
    struct dcmp_governor now = before;
    now.began = true;
    now.tick = tick;
    if (now.leads) {
        return dcmp_led(now, bounds, asked, dt);
    }
    if (!dcmp_allowed(asked, bounds)) {
        return dcmp_lead_on(now, bounds, asked, dt);
    }
    if (now.has_last && !(dcmp_magnitude(asked.position - now.last.position) <= bounds.velocity * dt)) {
        if (!dcmp_may_jump(now, bounds, asked.position, period)) {
            return dcmp_lead_on(now, bounds, asked, dt);
        }
        now.has_jumped = true;
        now.jumped = tick;
    }
    now.last = asked;
    now.has_last = true;
    return dcmp_passed(now, asked);
}

#endif
