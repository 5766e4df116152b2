#include "dcmp_encoder.h"

#define SPEED_WINDOW_US 1000
#define SECOND_US 1000000
#define JUMP_FACTOR 4 /* times the speed limit */
#define JUMP_FLOOR 8  /* counts: below, a short period would make a jump of every step */

static int64_t magnitude(int64_t value)
{
    return value < 0 ? -value : value;
}

static int32_t nearest(int64_t value)
{
    if (value > INT32_MAX) {
        return INT32_MAX;
    }
    return value < INT32_MIN ? INT32_MIN : (int32_t)value;
}

/* The shortest way from one count to the next. */
static int32_t difference(uint32_t to, uint32_t from)
{
    const uint32_t forward = (to - from) & DCMP_COUNT_MASK;
    return forward > DCMP_COUNT_MASK / 2u ? (int32_t)forward - (int32_t)DCMP_COUNT_MASK - 1 : (int32_t)forward;
}

void dcmp_encoder_init(struct dcmp_encoder *encoder, int32_t period_us)
{
    encoder->raw = 0;
    encoder->started = false;
    encoder->position = 0;
    for (uint32_t i = 0; i < DCMP_SPEED_PERIODS_MAX; i++) {
        encoder->past[i] = 0;
    }
    encoder->oldest = 0;
    encoder->span = (uint8_t)((SPEED_WINDOW_US + period_us - 1) / period_us);
    encoder->window_us = encoder->span * period_us;
    encoder->change = 0;
    encoder->jump = 0;
    encoder->jumped = false;
    dcmp_history_init(&encoder->jumps);
    encoder->anchored = false;
    encoder->origin = 0;
}

void dcmp_encoder_tick(struct dcmp_encoder *encoder, uint32_t counts, int32_t speed_limit, int32_t period_us)
{
    const int32_t step = encoder->started ? difference(counts, encoder->raw) : 0;
    const int64_t most = (int64_t)JUMP_FACTOR * speed_limit * period_us;
    encoder->started = true;
    encoder->raw = counts & DCMP_COUNT_MASK;
    encoder->jumped = magnitude(step) > JUMP_FLOOR && magnitude(step) * SECOND_US > most;
    dcmp_history_add(&encoder->jumps, encoder->jumped);
    if (encoder->jumped) {
        encoder->jump = step;
    } else {
        encoder->position += step;
    }
    encoder->change = (int32_t)(encoder->position - encoder->past[encoder->oldest]);
    encoder->past[encoder->oldest] = encoder->position;
    encoder->oldest = (uint8_t)((encoder->oldest + 1u) % encoder->span);
}

void dcmp_encoder_anchor(struct dcmp_encoder *encoder)
{
    if (!encoder->anchored) {
        encoder->anchored = true;
        encoder->origin = encoder->position;
    }
}

bool dcmp_encoder_too_jumpy(const struct dcmp_encoder *encoder)
{
    return encoder->jumped && encoder->jumps.count >= DCMP_JUMP_LIMIT;
}

/* One count more than the speed says: a count is no finer than that at either end. */
bool dcmp_encoder_too_fast(const struct dcmp_encoder *encoder, int32_t speed_limit)
{
    return (magnitude(encoder->change) - 1) * SECOND_US > (int64_t)speed_limit * encoder->window_us;
}

bool dcmp_encoder_too_far(const struct dcmp_encoder *encoder, int32_t travel_limit)
{
    return magnitude(encoder->position - encoder->origin) > travel_limit;
}

int32_t dcmp_encoder_speed(const struct dcmp_encoder *encoder)
{
    return nearest((int64_t)encoder->change * SECOND_US / encoder->window_us);
}

int32_t dcmp_encoder_travel(const struct dcmp_encoder *encoder)
{
    return nearest(encoder->position - encoder->origin);
}
