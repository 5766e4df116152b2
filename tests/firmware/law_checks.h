/* The law's headers behind functions for the tests: columns in, columns out, `n` rows. Numbers are doubles on this side;
 * each check file is compiled once for each type. No guard: Python reads it once for each type. */
#include <stdint.h>

#undef CHECK
#ifdef DCMP_REAL_FLOAT
#define CHECK(name) check_float_##name
#else
#define CHECK(name) check_##name
#endif

/* dcmp_elementary.h: out = f(x) */
void CHECK(magnitude)(const double *x, double *out, uint32_t n);
void CHECK(is_finite)(const double *x, double *out, uint32_t n);
void CHECK(square_root)(const double *x, double *out, uint32_t n);
void CHECK(nearest)(const double *x, double *out, uint32_t n);
void CHECK(floor)(const double *x, double *out, uint32_t n);
void CHECK(sine)(const double *x, double *out, uint32_t n);
void CHECK(cosine)(const double *x, double *out, uint32_t n);
void CHECK(expm1)(const double *x, double *out, uint32_t n);
void CHECK(exponential)(const double *x, double *out, uint32_t n);
void CHECK(logarithm)(const double *x, double *out, uint32_t n);
void CHECK(inverse_cube_root)(const double *x, double *out, uint32_t n);

/* dcmp_control.h */
void CHECK(matched_gains)(const double *x, double *out, uint32_t n);
void CHECK(step_periods)(const double *lengths, const double *dt, int32_t *out, uint32_t n);
/* Rows of t, y, voltage; estimates come out. `steps` has 11 numbers for each of 1 to 10 periods; `others` those of the steps
 * of another length, in their order. Time that stands still leaves all as it was. */
void CHECK(super_twisting)(const double *tuning, const double *steps, const double *others, const double *lengths,
                           const double *samples, double *out, uint32_t n);
void CHECK(ahead)(const double *predictor, const double *rows, double *out, uint32_t n); /* x1 x2 w V */
void CHECK(pd_voltage)(const double *pd, const double *rows, double *out, uint32_t n);   /* xr vr ar x1 x2 w */
/* Velocities, rad/s, and voltages; friction and the told voltage come out, and a disturbance of 1 rad/s2 made whole. */
void CHECK(known_friction)(double f1, double volts, const double *rows, double *out, uint32_t n);

/* dcmp_friction_kalman.h */
void CHECK(moved)(const double *rows, double *out, uint32_t n);  /* x1 x2 d f s step u f0 gravity */
/* Rows of the mean and the innovation; 1 for a step of the disturbance. */
void CHECK(stepped)(const double *rows, double *out, uint32_t n);
void CHECK(judged)(const double *rows, double *out, uint32_t n); /* the trust, nu, step, edge */
/* x1 x2 d f s, the covariance, the trust, a, sticks, t, of the last edge, y, rise, step; out come state, covariance, trust,
 * sticks and steps. */
void CHECK(by_edge)(const double *setup, const double *rows, double *out, uint32_t n);
/* Rows of t, y, voltage, voltage under way, velocity of the reference; of each come out the estimate, the state, the
 * covariance, the trust, sticks, steps, and the state ahead after `delay` periods. */
void CHECK(friction_kalman)(const double *setup, double period, uint32_t delay, const double *rows, double *out,
                            uint32_t n);

/* dcmp_random.h */
void CHECK(philox)(const double *rows, double *out, uint32_t n); /* four words of the block, two of the key */
void CHECK(random)(uint64_t seed, uint32_t stream, const double *counters, double *out, uint32_t n); /* uniform, normal */

/* dcmp_plant.h */
/* The model, belief f0 and ku, h, the position at the start; position, velocity and disturbance come out. */
void CHECK(plant)(const double *setup, uint32_t steps, const double *voltages, double *out, uint32_t n);
void CHECK(encoder)(const double *setup, const double *rows, double *out, uint32_t n); /* position, normal */
void CHECK(amplifier)(const double *setup, const double *commands, double *out, uint32_t n);

/* dcmp_trajectory.h: rows of ticks with the reference's x v a at `later` after the tick, at the tick before it and in the middle; the
 * trajectory begins at tick `begins` from x0. Of each row come out the three references. */
void CHECK(trajectory)(const double *setup, const double *rows, double *out, uint32_t n);

/* dcmp_run_phases.h: rows of tick, objection of the checks, demand, refusal, end and voltage of the polarity check, objection of the
 * limits. Of each row come out voltage, phase, whether the trajectory begins, over, orderly, cause and its tick, number of notes,
 * and the phase of the last note. */
void CHECK(phases)(const double *setup, const double *rows, double *out, uint32_t n);

/* dcmp_time.h: period first, in s; ticks, and rows of two of them. */
void CHECK(instant)(double period, const double *ticks, double *out, uint32_t n);
void CHECK(elapsed)(double period, const double *rows, double *out, uint32_t n);
void CHECK(lasting)(const double *setup, const double *ticks, double *out, uint32_t n); /* period, gap, allowed */
void CHECK(telling)(const double *setup, const double *ticks, double *out, uint32_t n); /* period, pause */

/* dcmp_cause.h */
void CHECK(leaves_time)(const double *causes, double *out, uint32_t n);

/* dcmp_monitors.h */
/* period, speed, floor, usual; tick, position; out come: off, count, and cause, tick and number of the objection. */
void CHECK(outliers)(const double *setup, const double *rows, double *out, uint32_t n);
void CHECK(all_finite)(const double *rows, double *out, uint32_t n); /* t, position, voltage, x1 x2 w */
void CHECK(range)(const double *setup, const double *rows, double *out, uint32_t n); /* position, velocity */
/* velocity, keep, limit, cycles; x1 x2 w; cause, filtered, above */
void CHECK(watch)(const double *setup, const double *rows, double *out, uint32_t n);

/* dcmp_limiter.h */
void CHECK(limited)(double most, const double *x, double *out, uint32_t n);
void CHECK(slewed)(double step, const double *rows, double *out, uint32_t n);        /* voltage, last */
void CHECK(chatter)(const double *setup, const double *rows, double *out, uint32_t n); /* period, limit; tick, change */
/* The setup in its order; tick, position, reference asked for and governed, whether it leads, demand, whether with authority
 * (else the demand is what is sent); out come the voltage, three times what is told, clamped, the objection, and
 * the cycles that are left of a block. */
void CHECK(limiter)(const double *setup, const double *rows, double *out, uint32_t n);

/* dcmp_governor.h. The bounds; of each row come out the reference, whether it is the governor's own, and whether that leads. */
void CHECK(governor)(const double *setup, double period, const double *rows, double *out, uint32_t n); /* tick, reference */
/* A governor that leads moves on by some ticks: ticks, its last reference, the one asked for. */
void CHECK(led)(const double *setup, double period, const double *rows, double *out, uint32_t n);

/* dcmp_polarity_check.h: ku, voltage, gravity, count */
/* Rows of tick, position, voltage; stage, cause, its two figures, voltage, gain, deviation, found and the cause's tick come out. */
void CHECK(polarity_check)(const double *setup, double period, const double *rows, double *out, uint32_t n);
void CHECK(motor_gain)(const double *setup, const double *rows, double *out, uint32_t n); /* time, way, voltage */
/* Gain, deviation, farthest point, voltage reached; the cause comes out. */
void CHECK(polarity_cause)(const double *setup, const double *rows, double *out, uint32_t n);

/* dcmp_cycle.h: `parameters` is struct run_parameters of boards/simlib/run.h. Rows of tick, position, voltage, the reference's velocity
 * in the middle and at the command's instant, and the reference. Of each row come out: left out, the estimate, the reference allowed,
 * demand, voltage, begins, phase, over, orderly, cause, its tick and two numbers, remembers, number of notes, the code, first and
 * second of 5 notes, motor gain and deviation. */
void CHECK(cycle)(const double *parameters, const double *rows, double *out, uint32_t n);
