/* A whole simulated run: the cycle of firmware/core/dcmp_cycle.h on the simulated rig, one call for many cycles.
 * The operations and their order are those of the loop on the host (dcmp_hil/loop.py, sim_backend/hardware.py), so that rows
 * and events have the same bits. Python reads structures and constants from this file: every field has 8 bytes, an array
 * has a length by names, and a flag is 0 or 1.
 *
 * Use: fill `run_parameters`; allocate run_state_bytes() bytes; run_begin; then run_cycles until it says that the run has
 * ended. It stops in between where it needs the host, and goes on in the middle of the cycle. Python looks at a request
 * to stop between two calls. */
#ifndef RUN_H
#define RUN_H

#include <stdint.h>

#define RUN_STEP_NUMBERS 11  /* f12 f22 gu1 gu2 h01 h02 h11 h12 k1 k2 k3 of one step of R1 */
#define RUN_GAPS 10          /* steps of 1 to 10 periods */
#define RUN_FIELDS 22        /* numbers of a row: dcmp_hil.ipc.ring.FIELDS */
#define RUN_FURTHER 8        /* behind them with the friction filter: FrictionKalman.DIAGNOSIS */
#define RUN_EVENTS_MIN 16    /* free places of the log that a cycle may need */

/* Kinds of observers. */
enum run_observer_kind { RUN_SUPER_TWISTING = 0, RUN_FRICTION_KALMAN = 1 };

/* An observer R1, from `dcmp_hil.control.observers.super_twisting.Tuning`. */
struct run_observer {
    double L1;         /* 1/s */
    double w1;         /* L2 + f0 L1, 1/s2 */
    double w2;         /* L1 + f0, 1/s */
    double M;          /* rad/s3 */
    double mu0;        /* rad/s */
    double floor_from; /* rad, M / mu0^3; infinity without a floor */
    double steps[RUN_GAPS * RUN_STEP_NUMBERS]; /* [gap - 1][number]; the rows of gaps that cannot be may be 0 */
};

/* The friction filter: struct dcmp_friction_setup, in its order. */
struct run_friction {
    double friction_f0;
    double friction_gravity;
    double friction_ku;
    double friction_f1;
    double friction_f_max;
    double friction_f1_variance;
    double friction_q;
    double friction_half_count;
    double friction_restart_after;
    double friction_unchanged_variance;
    double friction_edge_variance;
    double friction_d_noise;
};

/* What a run does not change. Names and meanings as in lanes.h where they are the same. */
struct run_parameters {
    /* the simulated rig */
    double period;             /* s */
    double plant_f0;           /* 1/s */
    double plant_f1;           /* rad/s2 */
    double plant_gravity;      /* rad/s2 */
    double plant_ku;           /* (rad/s2)/V */
    double plant_eta;          /* rad/s2 */
    double plant_eta_amplitude; /* rad/s2 */
    double plant_eta_rate;     /* rad/s */
    double plant_step;         /* s, rig.period / rig.plant_steps */
    int64_t plant_steps;       /* in a period */
    double plant_position;     /* rad, at the start: sim.position_rad */
    double count;              /* rad, one count of the encoder; 0 for an ideal one */
    double phase;              /* counts */
    double noise;              /* counts, or rad of an ideal encoder: standard deviation */
    int64_t seed;              /* its lowest 64 bits */
    double lost;               /* probability that a sample does not reach the host */
    double amplifier_limit;    /* V, either way; also the limiter's voltage */
    double amplifier_slew;     /* V a period; infinity for none */
    double dead_zone;          /* V */
    double quantum;            /* V; 0 for none */
    double delay_samples;      /* periods from command to output, 0 or 1 */
    /* the law */
    double delay;              /* s, from a sample to the instant at which its command acts: rig.delay */
    double f0;                 /* 1/s, of the model */
    double f1;                 /* rad/s2, of the model */
    double ku;                 /* (rad/s2)/V, of the model */
    double volts;              /* 1 / ku */
    double a;                  /* of the predictor: held_input(f0, period) */
    double p1;                 /* s */
    double p2;                 /* s2 */
    double kp;                 /* 1/s2 */
    double kd;                 /* 1/s */
    double compensation;       /* 1 with the estimated disturbance, 0 without */
    int64_t measured;          /* flag: the controller gets the measured position */
    int64_t feedforward;       /* flag: friction of the model is fed forward */
    int64_t observer_kind;     /* RUN_SUPER_TWISTING or RUN_FRICTION_KALMAN */
    struct run_observer own;   /* of RUN_SUPER_TWISTING */
    struct run_friction friction; /* of RUN_FRICTION_KALMAN */
    double soft_start;         /* s, over which the reference fades in; 0 for none */
    /* the supervisor */
    int64_t watched;           /* flag: supervisor.monitors is "all", not "finite" */
    struct run_observer watch; /* the observer that watches */
    double settle;             /* s at 0 V before the trajectory begins; 0 for an immediate start */
    double engage;             /* s, over which authority grows; 0 for an immediate start */
    int64_t probes;            /* flag: there is a polarity check */
    double probe_ku;           /* (rad/s2)/V, the believed motor gain */
    double probe_voltage;      /* V, of a push */
    double probe_gravity;      /* rad/s2 */
    double slew;               /* V a period, of the limiter; infinity for none, as with monitors = "finite" */
    double error_max;          /* rad, from the reference; infinity for none */
    int64_t governed;          /* flag: the reference has bounds (Limiter.bounds, finite position + velocity) */
    double reference_x_max;    /* rad, Bounds.position */
    double reference_v_max;    /* rad/s, Bounds.velocity */
    double reference_a_max;    /* rad/s2, Bounds.acceleration */
    double reference_braking;  /* rad/s2, Bounds.braking */
    double reference_strongest; /* rad/s2, Bounds.strongest */
    double reference_stop;     /* s2/rad, Bounds.stop */
    double position_max;       /* rad */
    double velocity_max;       /* rad/s, RangeMonitor.velocity_max: with its spare */
    double disturbance_max;    /* rad/s2 */
    double disturbance_keep;   /* filter_keep(period) */
    double disturbance_cycles; /* cycles_above(period) */
    double chatter_max;        /* V/s, limit_V_s(expected variation) */
    int64_t chatter_cycles;    /* of a block, block_cycles(period) */
    double jump_usual;         /* rad, OutlierFilter.usual */
    double jump_speed;         /* rad/s, OutlierFilter.speed */
    double jump_floor;         /* rad, OutlierFilter.floor */
};

/* The reference at the instants of one tick, from the host. What it is, `run_progress.whole` says:
 * 0: raw values of the source: at t + delay - t0, at t - t0, at 0.5 (t + t of the tick before) - t0, with t = tick * period
 *    and t0 = run_progress.began; all in the host's order of operations. C applies the fade; no row is needed before the
 *    trajectory begins, when it stays where the arm is.
 * 1: values of the trajectory itself, at device times t + delay, t and the middle. Every cycle needs a row. */
struct run_reference {
    double x; /* at t + delay: rad, rad/s, rad/s2 */
    double v;
    double a;
    double x_now; /* at t; used where a cycle is missing before, and where the trajectory begins; see has_now */
    double v_now;
    double a_now;
    double x_middle; /* in the middle between this tick and the one before; used where friction is fed forward */
    double v_middle;
};

/* Something to tell, in the order in which the loop on the host tells it. */
struct run_event {
    int64_t tick; /* of the cycle: t = tick * period */
    int64_t code; /* RUN_PHASE to RUN_SLEW */
    double a;
    double b;
    double c;
};

/* Codes of events, with their numbers a, b, c. */
enum run_code {
    RUN_PHASE = 1,        /* a: the new phase, RUN_PROBING to RUN_TRIPPED */
    RUN_PROBE = 2,        /* a, b: gain and its standard deviation, (rad/s2)/V */
    RUN_POSITION = 3,     /* reference limited: a = limit, b = asked for, rad: Limiter's "reference" */
    RUN_VELOCITY = 4,     /* a = limit, b = asked for, rad/s */
    RUN_ACCELERATION = 5, /* a = limit, b = asked for, rad/s2 */
    RUN_WAY = 6,          /* a = where the arm is led to, rad */
    RUN_VOLTAGE = 7,      /* a = asked for, b = allowed, V */
    RUN_SLEW = 8          /* a = asked for, b = the last one sent, V */
};

/* Phases of a run, in the order of dcmp_hil.safety.supervisor.Phase. */
enum run_phase {
    RUN_ARMING = 0,
    RUN_PROBING = 1,
    RUN_SETTLING = 2,
    RUN_ENGAGING = 3,
    RUN_RUNNING = 4,
    RUN_STOPPING = 5,
    RUN_TRIPPED = 6
};

/* Why run_cycles returned. */
enum run_reason {
    RUN_ROWS_FULL = 1,       /* `out` has no free row: take the rows, call again */
    RUN_LOG_FULL = 2,        /* `log` has fewer than RUN_EVENTS_MIN free places: take the events, call again */
    RUN_BEGINS = 3,          /* the trajectory begins at `began`, from x0: make rows from `tick` on, call again */
    RUN_ASKS = 4,            /* give answer_x, answer_v, answer_a of device time `asked`, as `whole` says; call again */
    RUN_REFERENCES_USED = 5, /* the rows do not have `tick`: give rows from it on, call again */
    RUN_REACHED = 6,         /* the cycle at or after `until` has ended */
    RUN_OVER = 7             /* the run is over: see cause, orderly and numbers. 0 V has been sent, the row is written */
};

/* What host and C tell each other; the host sets all of it to 0 at first, and `began` to infinity. */
struct run_progress {
    /* the host writes */
    double until;       /* s, device time: the cycle whose sample is at or after it is the last */
    int64_t fresh;      /* flag: loop.run was called anew (the way down); C sets it to 0. 1 before the first call */
    int64_t whole;      /* flag: what the rows are, see run_reference */
    int64_t has_now;    /* flag: the rows have x_now, v_now, a_now; else RUN_ASKS */
    int64_t has_middle; /* flag: the rows have x_middle, v_middle; else RUN_ASKS. A cycle after a gap asks */
    int64_t first_row;  /* tick of rows[0] */
    double answer_x;    /* to RUN_ASKS: rad, rad/s, rad/s2 */
    double answer_v;
    double answer_a;
    /* C writes */
    double asked;       /* s: raw values (whole = 0) are those of the source at asked - began */
    int64_t tick;       /* of the newest sample, that may be in the middle of its cycle */
    int64_t rows;       /* written by this call */
    int64_t events;     /* written by this call */
    int64_t cycles;     /* ended since the start */
    double began;       /* s, device time at which the trajectory began; infinity before it did */
    double x0;          /* rad, where it began */
    int64_t phase;      /* RUN_ARMING to RUN_TRIPPED */
    int64_t outliers;   /* samples left out: OutlierFilter.count */
    int64_t clamped;    /* Limiter.clamped */
    int64_t steps;      /* of the disturbance, that the friction filter assumed: FrictionKalman.steps */
    int64_t gain_known; /* flag: the polarity check has come to its fit, also where it refused */
    double gain;        /* (rad/s2)/V, measured motor gain */
    double deviation;   /* (rad/s2)/V */
    int64_t cause;      /* enum dcmp_cause of core/dcmp_cause.h; 0 for none. The first one, also while stopping */
    int64_t cause_tick; /* of the cycle that found it */
    double first;       /* numbers of its sentence, as dcmp_cause.h says; those of DCMP_CAUSE_NUMBERS are in the last row, */
    double second;      /* and the gain of DCMP_CAUSE_PROBE_GAIN is `gain` */
    int64_t orderly;    /* flag, at RUN_OVER: the voltage was led to 0 V before the end */
    int64_t remembers;  /* flag: the watching observer has taken the newest sample (the diagnosis remembers it) */
};

#define RUN_API __attribute__((visibility("default")))

struct run; /* its state: run_state_bytes() bytes */

RUN_API int64_t run_state_bytes(void);
RUN_API void run_begin(struct run *run, const struct run_parameters *parameters);

/* Run cycles; `out` has `max_rows` rows of RUN_FIELDS numbers, with the friction filter RUN_FIELDS + RUN_FURTHER. Returns why
 * it stopped, RUN_ROWS_FULL to RUN_OVER. */
RUN_API int64_t run_cycles(struct run *run, struct run_progress *progress, const struct run_reference *rows, int64_t n_rows,
                           double *out, int64_t max_rows, struct run_event *log, int64_t max_log);

#endif
