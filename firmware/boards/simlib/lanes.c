/* The tick of a block of lanes, and the loop over ticks. */
#include "lanes.h"

#include <stdbool.h>

#include "lanes_control.h"
#include "lanes_cycle.h"
#include "lanes_figures.h"
#include "lanes_observer.h"
#include "lanes_plant.h"
#include "lanes_safety.h"

/* Take the constants of an observer's step from those of every length. */
static void take_step(struct lanes_observer *o, const double *numbers, int l)
{
    o->f12[l] = numbers[l];
    o->f22[l] = numbers[DCMP_LANES + l];
    o->gu1[l] = numbers[2 * DCMP_LANES + l];
    o->gu2[l] = numbers[3 * DCMP_LANES + l];
    o->h01[l] = numbers[4 * DCMP_LANES + l];
    o->h02[l] = numbers[5 * DCMP_LANES + l];
    o->h11[l] = numbers[6 * DCMP_LANES + l];
    o->h12[l] = numbers[7 * DCMP_LANES + l];
    o->k1[l] = numbers[8 * DCMP_LANES + l];
    o->k2[l] = numbers[9 * DCMP_LANES + l];
    o->k3[l] = numbers[10 * DCMP_LANES + l];
}

/* Lose samples, and take the steps of the length that is left; returns whether a lane has to begin again. */
static bool lose(const struct lanes_common *common, struct lanes_block *block, struct lanes_cycle *c,
                 const double *gap_steps)
{
    const int length = LANES_STEP_NUMBERS * DCMP_LANES;
    bool restart = false;
    lanes_lose(&block->parameters, c);
    for (int l = 0; l < DCMP_LANES; l++) {
        struct lanes_state *s = &block->state;
        const double gap = s->missed[l] + 1.0;
        s->missed[l] = c->take[l] != 0 ? 0.0 : gap;
        if (c->take[l] != 0 && gap != s->gap[l]) {
            s->gap[l] = gap;
            if (gap <= (double)LANES_GAPS) {
                const double *numbers = &gap_steps[((int)gap - 1) * length];
                take_step(&block->own, numbers, l);
                take_step(&block->watch, &numbers[LANES_GAPS * length], l);
            }
        }
        restart = restart || (c->take[l] != 0 && !(c->dt[l] < common->longest_gap));
    }
    return restart;
}

/* Everything up to the sample. Returns whether a lane has to begin again. */
static inline bool sample(const struct lanes_common *common, struct lanes_block *block, struct lanes_cycle *c,
                          const double *gap_steps)
{
    struct lanes_state *s = &block->state;
    const struct lanes_parameters *p = &block->parameters;
    for (int l = 0; l < DCMP_LANES; l++) {
        c->take[l] = s->phase[l] != (double)LANES_OVER ? INT64_C(1) : INT64_C(0);
        c->flags[l] = 0;
        c->applied[l] = 0.0;
        c->dt[l] = c->t - s->t[l];
    }
    bool restart = c->tick == 0;
    if (c->tick > 0) {
        lanes_amplify(common, p, s, c->applied);
        lanes_move(common, p, s, c->applied, c->tick);
        if (common->gaps != 0) {
            restart = lose(common, block, c, gap_steps);
        }
    }
    lanes_measure(common, p, s, c->y);
    return restart;
}

/* Observer, reference and controller. */
static inline void control(const struct lanes_common *common, struct lanes_block *block, const struct lanes_row *row,
                           struct lanes_cycle *c, bool restart)
{
    struct lanes_state *s = &block->state;
    const struct lanes_parameters *p = &block->parameters;
    const struct lanes_estimates found = {c->x1, c->x2, c->w};
    const double *told = c->applied;
    if (common->friction != 0) {
        lanes_tell(row, p, s, c);
        told = c->told;
    }
    lanes_observe(&block->own, p->ku, c, told, found);
    if (restart) {
        lanes_restart(&block->own, c, common->longest_gap, found);
    }
    if (c->tick == 0) {
        for (int l = 0; l < DCMP_LANES; l++) {
            s->x0[l] = c->x1[l];
        }
    }
    lanes_refer(row, s, c);
    if (common->friction != 0) {
        lanes_add_friction(p, c);
    }
    lanes_align(common, row, s, c);
    if (common->watched != 0 && lanes_govern(p, s, c) != 0) {
        lanes_jump(p, s, c);
    }
    lanes_stray(common, p, s, c);
    lanes_command(common, p, s, c);
}

/* Checks, and the voltage to send. Returns whether anything was not usual. */
static inline bool supervise(const struct lanes_common *common, struct lanes_block *block, struct lanes_cycle *c,
                             bool restart)
{
    struct lanes_state *s = &block->state;
    const struct lanes_estimates seen = {c->watch_x1, c->watch_x2, c->watch_w};
    lanes_check_numbers(c);
    if (common->watched != 0) {
        lanes_observe(&block->watch, block->parameters.ku, c, c->applied, seen);
        if (restart) {
            lanes_restart(&block->watch, c, common->longest_gap, seen);
        }
        lanes_check_ranges(&block->parameters, s, c);
    }
    if (lanes_limit(common, &block->parameters, s, c) == 0) {
        return false;
    }
    lanes_decide(common, block, c);
    return true;
}

/* End the lanes whose time is over; returns how many go on. */
static int64_t going_on(const struct lanes_common *common, struct lanes_state *s, const struct lanes_cycle *c)
{
    int64_t going = 0;
    for (int l = 0; l < DCMP_LANES; l++) {
        const bool ends = c->take[l] != 0 && c->t >= common->until && s->phase[l] == (double)LANES_RUNNING;
        s->phase[l] = ends ? (double)LANES_OVER : s->phase[l];
        going += s->phase[l] == (double)LANES_OVER ? 0 : 1;
    }
    return going;
}

int64_t dcmp_lanes_run(const struct lanes_common *common, struct lanes_block *block, const struct lanes_row *rows,
                       int64_t first, int64_t count, const double *gap_steps, double *kept)
{
    struct lanes_cycle c;
    int64_t going = DCMP_LANES;
    for (int64_t k = 0; k < count && going > 0; k++) {
        const struct lanes_row *row = &rows[k];
        c.t = row->t;
        c.tick = first + k;
        const bool restart = sample(common, block, &c, gap_steps);
        if (common->watched != 0) {
            lanes_filter(&block->parameters, &block->own, &c);
        }
        control(common, block, row, &c, restart);
        const bool unusual = supervise(common, block, &c, restart);
        lanes_add_errors(&block->state, &c);
        lanes_send(&block->state, &c);
        if (common->kept > 0) {
            lanes_keep(common, &block->state, &c, kept);
        }
        if (unusual || c.t >= common->until) {
            going = going_on(common, &block->state, &c);
        }
    }
    return going;
}

int64_t dcmp_lanes_block_bytes(void)
{
    return (int64_t)sizeof(struct lanes_block);
}
