/* The supervisor of every lane: dcmp_hil/safety/{supervisor,monitors,limiter,chatter,outlier_filter}.py. */
#ifndef LANES_SAFETY_H
#define LANES_SAFETY_H

#include "lanes_cycle.h"

#define LANES_INFINITE (__builtin_inf())
#define LANES_SATURATION_TIME_MAX 0.5 /* s */
#define LANES_RAMP_TIME 0.05          /* s */
#define LANES_RATES_MEAN 10           /* blocks of the mean that is judged */
#define LANES_BURST_SCORE_MAX 40.0
#define LANES_SAME 1e-9 /* of a limit: how near it the order of a sum may matter */

/* A position that no arm can have reached is for the loop on the host. */
static inline void lanes_filter(const struct lanes_parameters *restrict p, const struct lanes_observer *restrict o,
                                struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double moved = dcmp_magnitude(c->y[l] - o->y[l]);
        const double way = p->jump_speed[l] * c->dt[l];
        const double allowed = way > p->jump_floor[l] ? way : p->jump_floor[l];
        const int64_t off = allowed < moved ? LANES_FLAG_REPEAT : 0;
        c->flags[l] |= moved <= p->jump_usual[l] ? 0 : off;
    }
}

/* Every number is finite. */
static inline void lanes_check_numbers(struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double sum = c->t + c->y[l] + c->applied[l] + c->x1[l] + c->x2[l] + c->w[l];
        c->flags[l] |= dcmp_magnitude(sum) < LANES_INFINITE ? 0 : LANES_FLAG_NOT_FINITE;
        c->flags[l] |= dcmp_magnitude(c->demand[l]) < LANES_INFINITE ? 0 : LANES_FLAG_DEMAND;
    }
}

/* Speed, travel, and the second observer. */
static inline void lanes_check_ranges(const struct lanes_parameters *restrict p, struct lanes_state *restrict s,
                                      struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double fastest = p->velocity_max[l];
        const double w = c->watch_w[l];
        const double filtered = w + p->disturbance_keep[l] * (s->filtered[l] - w);
        const double above = s->above[l] + 1.0;
        const double high = dcmp_magnitude(filtered) <= p->disturbance_max[l] ? 0.0 : above;
        const int64_t long_ = high < p->disturbance_cycles[l] ? 0 : LANES_FLAG_DISTURBANCE;
        const int64_t known = filtered == filtered ? long_ : LANES_FLAG_DISTURBANCE;
        int64_t flags = dcmp_magnitude(c->x2[l]) <= fastest ? 0 : LANES_FLAG_SPEED;
        flags |= dcmp_magnitude(c->y[l]) <= p->position_max[l] ? 0 : LANES_FLAG_TRAVEL;
        flags |= dcmp_magnitude(c->watch_x2[l]) <= fastest ? 0 : LANES_FLAG_WATCH_SPEED;
        c->flags[l] |= flags | known;
        s->filtered[l] = c->take[l] != 0 ? filtered : s->filtered[l];
        s->above[l] = c->take[l] != 0 ? high : s->above[l];
    }
}

/* The voltage with full authority: limits, how long they act, and the variation. */
static inline int64_t lanes_limit(const struct lanes_common *common, const struct lanes_parameters *restrict p,
                                  struct lanes_state *restrict s, struct lanes_cycle *restrict c)
{
    const double t = c->t;
    int64_t any = 0;
    for (int l = 0; l < DCMP_LANES; l++) {
        const double demand = c->demand[l];
        const double last = s->sent[l];
        const double most = p->amplifier_limit[l];
        const double up = last + p->slew[l];
        const double down = last - p->slew[l];
        const double below = demand < most ? demand : most;
        const double clamped = below > -most ? below : -most;
        const double slower = clamped < up ? clamped : up;
        const double voltage = slower > down ? slower : down;
        const int64_t runs = s->phase[l] == (double)LANES_RUNNING ? c->take[l] : 0;
        const int64_t limited = voltage != demand ? runs : 0;
        const double began = t - s->saturated_last[l] <= common->consecutive_gap ? s->saturated_since[l] : t;
        const int64_t long_ = t - began >= LANES_SATURATION_TIME_MAX ? LANES_FLAG_SATURATION : 0;
        const double change = voltage > last ? voltage - last : last - voltage;
        const double left = s->left[l] - 1.0;
        const int64_t over = left == 0.0 ? LANES_FLAG_BLOCK : 0;
        const int64_t stopping = runs != 0 ? over : LANES_FLAG_STOPPING;
        s->saturated_since[l] = limited != 0 ? began : s->saturated_since[l];
        s->saturated_last[l] = limited != 0 ? t : s->saturated_last[l];
        s->change[l] = runs != 0 ? s->change[l] + change : s->change[l];
        s->left[l] = runs != 0 ? left : s->left[l];
        c->flags[l] |= (limited != 0 ? long_ : 0) | stopping;
        c->flags[l] = c->take[l] != 0 ? c->flags[l] : 0;
        c->last[l] = last;
        c->voltage[l] = voltage;
        any |= c->flags[l];
    }
    return any;
}

/* Judge the variation of one lane over a block that is over: 1 for chatter, 0 for none. Where the limit is not the
 * rig's own, or the order of a sum may matter, less than 0: how to repeat the run. */
static inline int lanes_judge_chatter(const struct lanes_common *common, struct lanes_block *block,
                                      const struct lanes_cycle *c, int l)
{
    struct lanes_state *s = &block->state;
    const double limit = block->parameters.chatter_max[l];
    const double gone = c->t - s->block_t[l];
    const double change = s->change[l];
    s->block_t[l] = c->t;
    s->change[l] = 0.0;
    s->left[l] = (double)common->chatter_cycles;
    if (!(gone > 0.0)) {
        return 0;
    }
    for (int i = 0; i < LANES_RATES - 1; i++) { /* the newest is the last */
        block->rates[i * DCMP_LANES + l] = block->rates[(i + 1) * DCMP_LANES + l];
    }
    block->rates[(LANES_RATES - 1) * DCMP_LANES + l] = change / gone;
    s->blocks[l] += 1.0;
    const int known = s->blocks[l] < (double)LANES_RATES ? (int)s->blocks[l] : LANES_RATES;
    double sum = 0.0;
    double pause = 0.0;
    bool paused = false;
    const int oldest = LANES_RATES - known;
    for (int i = oldest; i < LANES_RATES; i++) {
        const double rate = block->rates[i * DCMP_LANES + l];
        sum = i > 0 ? sum + rate : sum;
        pause = i > oldest ? block->rates[(i - 1) * DCMP_LANES + l] + rate : rate;
        paused = paused || (i > oldest && !(pause >= limit));
    }
    const double mean = sum / (double)LANES_RATES_MEAN;
    const bool goes_on = mean >= limit && pause >= limit;
    const double fewer = s->bursts[l] > 1.0 ? s->bursts[l] - 1.0 : 0.0;
    s->bursts[l] = goes_on ? s->bursts[l] + 2.0 : fewer;
    if (common->exact == 0 && mean >= limit * (1.0 - LANES_SAME)) {
        return -LANES_WITH_EXACT;
    }
    if (dcmp_magnitude(mean - limit) <= LANES_SAME * limit) {
        return -LANES_BY_LOOP;
    }
    return (goes_on && known == LANES_RATES && !paused) || s->bursts[l] >= LANES_BURST_SCORE_MAX ? 1 : 0;
}

/* Why a lane has to stop at once, the first of the checks' order. */
static inline int lanes_cause(int64_t flags)
{
    if ((flags & LANES_FLAG_NOT_FINITE) != 0) {
        return LANES_NOT_FINITE;
    }
    if ((flags & LANES_FLAG_SPEED) != 0) {
        return LANES_SPEED;
    }
    if ((flags & LANES_FLAG_TRAVEL) != 0) {
        return LANES_TRAVEL;
    }
    if ((flags & LANES_FLAG_WATCH_SPEED) != 0) {
        return LANES_SPEED;
    }
    return (flags & LANES_FLAG_DISTURBANCE) != 0 ? LANES_DISTURBANCE : LANES_NOT_FINITE;
}

/* End a lane at 0 V; the first cause stays. */
static inline void lanes_trip(struct lanes_state *s, struct lanes_cycle *c, int l, int cause)
{
    s->cause[l] = s->cause[l] == (double)LANES_NONE ? (double)cause : s->cause[l];
    s->phase[l] = (double)LANES_OVER;
    c->voltage[l] = 0.0;
}

/* The way of one lane to 0 V. */
static inline void lanes_ramp(const struct lanes_parameters *p, struct lanes_state *s, struct lanes_cycle *c, int l)
{
    const double gone = c->t - s->stop_since[l];
    if (!(gone < LANES_RAMP_TIME)) {
        lanes_trip(s, c, l, LANES_NONE);
        return;
    }
    const double most = s->stop_from[l] * (1.0 - gone / LANES_RAMP_TIME);
    const double last = c->last[l];
    const double below = c->demand[l] < most ? c->demand[l] : most;
    const double clamped = below > -most ? below : -most;
    const double slower = clamped < last + p->slew[l] ? clamped : last + p->slew[l];
    const double voltage = slower > last - p->slew[l] ? slower : last - p->slew[l];
    c->voltage[l] = most > 0.0 ? voltage : 0.0;
}

/* What is not usual, lane by lane: trips, the way to 0 V, and blocks that are over. */
static inline void lanes_decide(const struct lanes_common *common, struct lanes_block *block,
                                struct lanes_cycle *restrict c)
{
    struct lanes_state *s = &block->state;
    for (int l = 0; l < DCMP_LANES; l++) {
        const int64_t flags = c->flags[l];
        if (flags == 0) {
            continue;
        }
        if ((flags & LANES_FLAG_REPEAT) != 0) {
            s->repeat[l] = (double)LANES_BY_LOOP;
            s->phase[l] = (double)LANES_OVER;
        } else if ((flags & LANES_FLAGS_NOW) != 0) {
            lanes_trip(s, c, l, lanes_cause(flags));
        } else if ((flags & LANES_FLAG_STOPPING) != 0) {
            lanes_ramp(&block->parameters, s, c, l);
        } else {
            const int chatter = (flags & LANES_FLAG_BLOCK) != 0 ? lanes_judge_chatter(common, block, c, l) : 0;
            int cause = chatter > 0 ? LANES_CHATTER : LANES_NONE;
            cause = (flags & LANES_FLAG_TRACKING) != 0 ? LANES_TRACKING : cause;
            cause = (flags & LANES_FLAG_SATURATION) != 0 ? LANES_SATURATION : cause;
            if (chatter < 0) {
                s->repeat[l] = (double)-chatter;
                s->phase[l] = (double)LANES_OVER;
            } else if (cause != LANES_NONE) {
                s->cause[l] = (double)cause;
                s->phase[l] = (double)LANES_STOPPING;
                s->stop_since[l] = c->t;
                s->stop_from[l] = dcmp_magnitude(c->voltage[l]);
            } else {
                /* A block is over, and its variation is usual. */
            }
        }
    }
}

#endif
