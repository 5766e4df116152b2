/* A sweep in lanes: DCMP_LANES runs side by side, one number of each run in a row of an array.
 * Every lane computes what the loop on the host computes, with the same operations in the same order, so that its
 * figures have the same bits. sim_backend/lanes/layout.py reads the names and their order from this file. */
#ifndef LANES_H
#define LANES_H

#include <stdint.h>

#ifndef DCMP_LANES
#define DCMP_LANES 32
#endif
#define LANES_STEP_NUMBERS 11  /* f12 f22 gu1 gu2 h01 h02 h11 h12 k1 k2 k3 of one step of R1 */
#define LANES_GAPS 10          /* steps of 1 to 10 periods */
#define LANES_RATES 11         /* blocks that chatter is judged by */

/* What all lanes of a block have in common; flags are 0 or 1. */
struct lanes_common {
    double period;          /* s */
    double until;           /* s, device time: the cycle at or after it is the last */
    double longest_gap;     /* s, from which on the observer begins again */
    double consecutive_gap; /* s, between two cycles of one condition */
    int64_t plant_steps;    /* in a period */
    int64_t delayed;        /* a command acts one period later */
    int64_t shaped;         /* the amplifier has slew, dead zone or steps */
    int64_t noisy;          /* the encoder has noise */
    int64_t gaps;           /* samples are lost */
    int64_t friction;       /* friction is fed forward */
    int64_t measured;       /* the controller gets the measured position */
    int64_t watched;        /* all monitors, not those of finite numbers alone */
    int64_t exact;          /* the limit of the variation is the rig's own, not the lowest of all rigs */
    int64_t chatter_cycles; /* in a block of the judgement of chatter */
    int64_t kept;           /* samples that are kept for a diagnosis; 0 for none */
};

/* The reference and its soft start at the instants of one tick, from the host's trajectory. */
struct lanes_row {
    double t; /* s */
    double x; /* of the source at t + delay: rad, rad/s, rad/s2 */
    double v;
    double a;
    double fading; /* 1 while the soft start acts at t + delay */
    double gone;   /* its weight and the two derivatives of that */
    double gone1;
    double gone2;
    double x_now; /* the same at t */
    double fading_now;
    double gone_now;
    double x_middle; /* and in the middle between this tick and the one before */
    double v_middle;
    double fading_middle;
    double gone_middle;
    double gone1_middle;
};

/* An observer R1: gains, and the constants of its present step. */
struct lanes_observer {
    double L1[DCMP_LANES];
    double w1[DCMP_LANES];
    double w2[DCMP_LANES];
    double M[DCMP_LANES];
    double mu0[DCMP_LANES];
    double floor_from[DCMP_LANES];
    double f12[DCMP_LANES];
    double f22[DCMP_LANES];
    double gu1[DCMP_LANES];
    double gu2[DCMP_LANES];
    double h01[DCMP_LANES];
    double h02[DCMP_LANES];
    double h11[DCMP_LANES];
    double h12[DCMP_LANES];
    double k1[DCMP_LANES];
    double k2[DCMP_LANES];
    double k3[DCMP_LANES];
    double y[DCMP_LANES];
    double z1[DCMP_LANES];
    double z2[DCMP_LANES];
    double v1[DCMP_LANES];
    double v2[DCMP_LANES];
    double v3[DCMP_LANES];
};

/* What a lane does not change. */
struct lanes_parameters {
    double plant_f0[DCMP_LANES];
    double plant_f1[DCMP_LANES];
    double plant_gravity[DCMP_LANES];
    double plant_ku[DCMP_LANES];
    double plant_eta[DCMP_LANES];
    double plant_eta_amplitude[DCMP_LANES];
    double plant_eta_rate[DCMP_LANES];
    double plant_step[DCMP_LANES]; /* s */
    double f0[DCMP_LANES]; /* of the model */
    double f1[DCMP_LANES];
    double ku[DCMP_LANES];
    double volts[DCMP_LANES]; /* 1 / ku */
    double count[DCMP_LANES]; /* rad; 0 for an ideal encoder */
    double phase[DCMP_LANES];
    double noise[DCMP_LANES];
    int64_t seed_low[DCMP_LANES]; /* 32 bits each */
    int64_t seed_high[DCMP_LANES];
    double lost[DCMP_LANES];
    double amplifier_limit[DCMP_LANES]; /* V */
    double amplifier_slew[DCMP_LANES];  /* V a period */
    double dead_zone[DCMP_LANES];       /* V */
    double quantum[DCMP_LANES];         /* V */
    double a[DCMP_LANES]; /* of the predictor */
    double p1[DCMP_LANES];
    double p2[DCMP_LANES];
    double kp[DCMP_LANES];
    double kd[DCMP_LANES];
    double compensation[DCMP_LANES];
    double slew[DCMP_LANES];             /* V a period, of the limiter */
    double error_max[DCMP_LANES];        /* rad */
    double reference_x_max[DCMP_LANES];  /* of the governor */
    double reference_v_max[DCMP_LANES];
    double reference_a_max[DCMP_LANES];
    double reference_stop[DCMP_LANES];   /* s2/rad: the way of a stop over the square of the velocity */
    double jump_x_max[DCMP_LANES];       /* rad: a longer jump is led */
    double position_max[DCMP_LANES];     /* of the supervisor */
    double velocity_max[DCMP_LANES];
    double disturbance_max[DCMP_LANES];
    double disturbance_keep[DCMP_LANES];
    double disturbance_cycles[DCMP_LANES];
    double chatter_max[DCMP_LANES];      /* V/s */
    double jump_usual[DCMP_LANES];       /* rad, from one sample to the next */
    double jump_speed[DCMP_LANES];       /* rad/s */
    double jump_floor[DCMP_LANES];       /* rad */
};

/* What a lane does change. */
struct lanes_state {
    double x1[DCMP_LANES]; /* of the plant */
    double x2[DCMP_LANES];
    double before[DCMP_LANES]; /* rad/s, the velocity before the last step */
    double w[DCMP_LANES]; /* by the model's f0 and ku */
    double sent[DCMP_LANES];      /* V, the newest command */
    double waiting[DCMP_LANES];   /* V, the command before it */
    double ramp[DCMP_LANES];      /* V, of the amplifier's slew */
    double t[DCMP_LANES];         /* s, of the last cycle */
    double missed[DCMP_LANES];    /* ticks since then */
    double gap[DCMP_LANES];       /* periods of the observers' present step */
    double x0[DCMP_LANES];        /* rad, where the trajectory began */
    double reference_x[DCMP_LANES]; /* rad, of the last cycle */
    double jumped[DCMP_LANES];      /* s, last jump of the reference */
    double filtered[DCMP_LANES];    /* rad/s2, of the watch */
    double above[DCMP_LANES];       /* cycles */
    double astray_since[DCMP_LANES];
    double astray_last[DCMP_LANES];
    double saturated_since[DCMP_LANES];
    double saturated_last[DCMP_LANES];
    double change[DCMP_LANES]; /* V, sum of |dV| of the block */
    double left[DCMP_LANES];   /* cycles to the end of the block */
    double block_t[DCMP_LANES]; /* s, at which the last block ended */
    double bursts[DCMP_LANES];
    double blocks[DCMP_LANES];
    double phase[DCMP_LANES];     /* LANES_RUNNING, LANES_STOPPING, LANES_OVER */
    double stop_since[DCMP_LANES];
    double stop_from[DCMP_LANES]; /* V */
    double cause[DCMP_LANES];     /* LANES_NONE, or why the run ends before its time */
    double repeat[DCMP_LANES];    /* LANES_ONCE, or how the run has to be repeated */
    int64_t periods[DCMP_LANES];
    double tracking_cycles[DCMP_LANES]; /* those whose error is a number */
    double velocity_cycles[DCMP_LANES];
    double disturbance_cycles[DCMP_LANES];
    double tracking_squares[DCMP_LANES];
    double tracking_max[DCMP_LANES];
    double velocity_squares[DCMP_LANES];
    double velocity_error_max[DCMP_LANES];
    double disturbance_squares[DCMP_LANES];
    double disturbance_error_max[DCMP_LANES];
    double peak[DCMP_LANES];
    double variation[DCMP_LANES];
};

/* One block. `gap_steps` and `kept` are arrays of their own, or null where none are needed. */
struct lanes_block {
    struct lanes_parameters parameters;
    struct lanes_state state;
    struct lanes_observer own;
    struct lanes_observer watch;
    double rates[LANES_RATES * DCMP_LANES]; /* V/s, a ring */
};

enum { LANES_ONCE = 0, LANES_BY_LOOP = 1, LANES_WITH_EXACT = 2 };
enum { LANES_RUNNING = 0, LANES_STOPPING = 1, LANES_OVER = 2 };
enum {
    LANES_NONE = 0,
    LANES_NOT_FINITE = 1,
    LANES_SPEED = 2,
    LANES_TRAVEL = 3,
    LANES_DISTURBANCE = 4,
    LANES_TRACKING = 5,
    LANES_SATURATION = 6,
    LANES_CHATTER = 7
};

/* Run ticks `first` to `first + count - 1`, of which `rows` tells the reference; return the lanes that go on.
 * gap_steps: [observer][gap][number][lane]. kept: [sample][t, position, voltage][lane], a ring by the cycle. */
__attribute__((visibility("default"))) int64_t dcmp_lanes_run(const struct lanes_common *common,
                                                              struct lanes_block *block,
                                                              const struct lanes_row *rows, int64_t first,
                                                              int64_t count, const double *gap_steps, double *kept);
__attribute__((visibility("default"))) int64_t dcmp_lanes_block_bytes(void);

#endif
