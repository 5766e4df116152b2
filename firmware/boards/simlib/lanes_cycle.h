/* What one stage of a cycle gives to the next, a row of lanes each. */
#ifndef LANES_CYCLE_H
#define LANES_CYCLE_H

#include "dcmp_control.h"
#include "lanes.h"

/* Lanes whose observers decide together whether an innovation is so small that the sliding gains are needed. */
#define LANES_GROUP (DCMP_LANES < 8 ? DCMP_LANES : 8)

/* What happened to a lane in a cycle; none of it is usual. */
enum {
    LANES_FLAG_NOT_FINITE = 1,
    LANES_FLAG_SPEED = 2,
    LANES_FLAG_TRAVEL = 4,
    LANES_FLAG_WATCH_SPEED = 8,
    LANES_FLAG_DISTURBANCE = 16,
    LANES_FLAG_DEMAND = 32,
    LANES_FLAG_TRACKING = 64,
    LANES_FLAG_SATURATION = 128,
    LANES_FLAG_BLOCK = 256, /* the block that chatter is judged by is over */
    LANES_FLAG_JUMP = 512,
    LANES_FLAG_REPEAT = 1024,
    LANES_FLAG_STOPPING = 2048
};
#define LANES_FLAGS_NOW                                                                                   \
    (LANES_FLAG_NOT_FINITE | LANES_FLAG_SPEED | LANES_FLAG_TRAVEL | LANES_FLAG_WATCH_SPEED |               \
     LANES_FLAG_DISTURBANCE | LANES_FLAG_DEMAND)

struct lanes_cycle {
    double t; /* s */
    int64_t tick;
    int64_t take[DCMP_LANES];  /* 1: the lane has a cycle in this tick */
    int64_t flags[DCMP_LANES];
    double dt[DCMP_LANES];     /* s, since the last cycle */
    double y[DCMP_LANES];      /* rad, measured */
    double applied[DCMP_LANES]; /* V, over the period that ends */
    double told[DCMP_LANES];    /* V, the same for the observer */
    double x1[DCMP_LANES];      /* the estimate */
    double x2[DCMP_LANES];
    double w[DCMP_LANES];
    double watch_x1[DCMP_LANES]; /* that of the watch */
    double watch_x2[DCMP_LANES];
    double watch_w[DCMP_LANES];
    double x[DCMP_LANES]; /* the reference at t + delay */
    double v[DCMP_LANES];
    double a[DCMP_LANES];
    double x_now[DCMP_LANES]; /* rad, the reference at t */
    double demand[DCMP_LANES]; /* V */
    double voltage[DCMP_LANES]; /* V, to be sent */
    double last[DCMP_LANES];    /* V, that was sent before */
};

#endif
