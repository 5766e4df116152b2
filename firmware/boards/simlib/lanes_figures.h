/* The figures of every lane, summed in the order of its cycles: dcmp_hil/telemetry/statistics.py. */
#ifndef LANES_FIGURES_H
#define LANES_FIGURES_H

#include "lanes_cycle.h"

/* Add one error; one that is no number is left out. */
static inline void lanes_add_error(double error, int64_t take, double *restrict cycles, double *restrict squares,
                                   double *restrict largest)
{
    const int64_t known = error == error ? take : 0;
    const double size = dcmp_magnitude(error);
    const double more = *squares + error * error;
    const double max = size > *largest ? size : *largest;
    *cycles = known != 0 ? *cycles + 1.0 : *cycles;
    *squares = known != 0 ? more : *squares;
    *largest = known != 0 ? max : *largest;
}

/* The three errors against the truth. */
static inline void lanes_add_errors(struct lanes_state *restrict s, const struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        lanes_add_error(s->x1[l] - c->x_now[l], c->take[l], &s->tracking_cycles[l], &s->tracking_squares[l],
                        &s->tracking_max[l]);
        lanes_add_error(c->x2[l] - s->x2[l], c->take[l], &s->velocity_cycles[l], &s->velocity_squares[l],
                        &s->velocity_error_max[l]);
        lanes_add_error(c->w[l] - s->w[l], c->take[l], &s->disturbance_cycles[l], &s->disturbance_squares[l],
                        &s->disturbance_error_max[l]);
    }
}

/* The voltage sent, and what else the next cycle needs of this one. */
static inline void lanes_send(struct lanes_state *restrict s, const struct lanes_cycle *restrict c)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        const double size = dcmp_magnitude(c->voltage[l]);
        const double step = dcmp_magnitude(c->voltage[l] - c->last[l]);
        const double peak = size > s->peak[l] ? size : s->peak[l];
        const double varied = c->tick > 0 ? s->variation[l] + step : 0.0;
        s->peak[l] = c->take[l] != 0 ? peak : s->peak[l];
        s->variation[l] = c->take[l] != 0 ? varied : s->variation[l];
        s->sent[l] = c->take[l] != 0 ? c->voltage[l] : s->sent[l];
        s->periods[l] = s->periods[l] + c->take[l];
        s->t[l] = c->take[l] != 0 ? c->t : s->t[l];
    }
}

/* Keep the last samples of each lane, for the diagnosis of a run that ended. */
static inline void lanes_keep(const struct lanes_common *common, const struct lanes_state *s,
                              const struct lanes_cycle *c, double *kept)
{
    for (int l = 0; l < DCMP_LANES; l++) {
        if (c->take[l] != 0) {
            double *place = &kept[(s->periods[l] % common->kept) * 3 * DCMP_LANES + l];
            place[0] = c->t;
            place[DCMP_LANES] = c->y[l];
            place[2 * DCMP_LANES] = c->applied[l];
        }
    }
}

#endif
