#include "dcmp_encoder.h"

#define SHORT_US 1000 /* finds a push soon, but a limit below a count or two in it not at all */
#define LONG_US 8000  /* for these */
#define LONG (DCMP_WINDOWS - 1u)
#define SECOND_US 1000000
#define JUMP_FACTOR 4 /* times the speed limit */
#define JUMP_FLOOR 8  /* counts: below, a short period would make a jump of every step */

static int64_t magnitude(int64_t value)
{
    return value < 0 ? -value : value;
}

static int64_t lesser(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t greater(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static int64_t middle(int64_t a, int64_t b, int64_t c)
{
    return greater(lesser(a, b), lesser(greater(a, b), c));
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

/* Where it was some periods ago. */
static int64_t past(const struct dcmp_encoder *encoder, uint32_t ago)
{
    return encoder->past[(encoder->newest + DCMP_POSITIONS - ago) % DCMP_POSITIONS];
}

static int64_t change(const struct dcmp_encoder *encoder, uint32_t end, uint32_t periods)
{
    return past(encoder, end) - past(encoder, end + periods);
}

/* A wrong count makes one change too large and one, the other way, when it is the older end: never the middle one. */
static int64_t middle_change(const struct dcmp_encoder *encoder, uint32_t periods)
{
    return middle(change(encoder, 0, periods), change(encoder, 1, periods), change(encoder, 2, periods));
}

static int64_t middle_position(const struct dcmp_encoder *encoder)
{
    return middle(past(encoder, 0), past(encoder, 1), past(encoder, 2));
}

static bool is_jump(int32_t step, int32_t speed_limit, int32_t period_us)
{
    const int64_t most = (int64_t)JUMP_FACTOR * speed_limit * period_us;
    return magnitude(step) > JUMP_FLOOR && magnitude(step) * SECOND_US > most;
}

/* A count is no finer than that at either end, so a steady speed may show a count more than it has. */
static bool above(int64_t moved, int64_t spare, int32_t speed_limit, int32_t us)
{
    return (magnitude(moved) - spare) * SECOND_US > (int64_t)speed_limit * us;
}

static bool too_fast_over(const struct dcmp_encoder *encoder, uint32_t i, const struct dcmp_speed_limits *limits)
{
    const struct dcmp_window *window = &encoder->windows[i];
    const int32_t limit = i == LONG ? limits->session : limits->built; /* a tremble of 2 counts is fast over 1 ms */
    return above(middle_change(encoder, window->periods), window->spare, limit, window->us);
}

/* The first window over which it is too fast; DCMP_WINDOWS if over none. */
static uint32_t window_too_fast(const struct dcmp_encoder *encoder, const struct dcmp_speed_limits *limits)
{
    uint32_t i = 0;
    while (i < DCMP_WINDOWS && !too_fast_over(encoder, i, limits)) {
        i++;
    }
    return i;
}

static struct dcmp_window window_of(int32_t periods, uint8_t spare, int32_t period_us)
{
    const struct dcmp_window window = {(uint8_t)periods, spare, periods * period_us};
    return window;
}

void dcmp_encoder_init(struct dcmp_encoder *encoder, int32_t period_us)
{
    const int32_t brief = (SHORT_US + period_us - 1) / period_us;
    encoder->raw = 0;
    encoder->raw_before = 0;
    encoder->raw_oldest = 0;
    encoder->started = false;
    encoder->position = 0;
    for (uint32_t i = 0; i < DCMP_POSITIONS; i++) {
        encoder->past[i] = 0;
    }
    encoder->newest = 0;
    encoder->windows[0] = window_of(brief, 1, period_us);
    encoder->windows[1] = window_of(2 * brief, 2, period_us);
    encoder->windows[2] = window_of((LONG_US + period_us - 1) / period_us, 1, period_us);
    encoder->jump = 0;
    encoder->jumped = false;
    dcmp_history_init(&encoder->jumps);
    encoder->anchored = false;
    encoder->origin = 0;
}

void dcmp_encoder_tick(struct dcmp_encoder *encoder, uint32_t counts, int32_t built_speed_limit, int32_t period_us)
{
    const int32_t step = encoder->started ? difference(counts, encoder->raw) : 0;
    const int32_t two_steps = encoder->started ? difference(counts, encoder->raw_before) : 0;
    const bool near_a_jump = encoder->jumped;
    encoder->jumped = is_jump(step, built_speed_limit, period_us);
    dcmp_history_add(&encoder->jumps, encoder->jumped);
    if (encoder->jumped) {
        encoder->jump = step;
    }
    if ((near_a_jump || encoder->jumped) && !above(two_steps, 2, built_speed_limit, 2 * period_us)) {
        encoder->position = past(encoder, 1) + two_steps; /* the count between was wrong */
    } else if (!encoder->jumped) {
        encoder->position += step;
    } else {
        /* the next count says whether this one was wrong */
    }
    encoder->raw_oldest = encoder->raw_before; /* at the first count 0: never the middle one of two that are equal */
    encoder->raw_before = encoder->started ? encoder->raw : counts & DCMP_COUNT_MASK;
    encoder->raw = counts & DCMP_COUNT_MASK;
    encoder->started = true;
    encoder->newest = (uint8_t)((encoder->newest + 1u) % DCMP_POSITIONS);
    encoder->past[encoder->newest] = encoder->position;
}

void dcmp_encoder_anchor(struct dcmp_encoder *encoder)
{
    if (!encoder->anchored) {
        encoder->anchored = true;
        encoder->origin = middle_position(encoder);
    }
}

bool dcmp_encoder_too_jumpy(const struct dcmp_encoder *encoder)
{
    return encoder->jumped && encoder->jumps.count >= DCMP_JUMP_LIMIT;
}

bool dcmp_encoder_too_fast(const struct dcmp_encoder *encoder, const struct dcmp_speed_limits *limits)
{
    return window_too_fast(encoder, limits) < DCMP_WINDOWS;
}

bool dcmp_encoder_too_far(const struct dcmp_encoder *encoder, int32_t travel_limit)
{
    return magnitude(middle_position(encoder) - encoder->origin) > travel_limit;
}

int32_t dcmp_encoder_speed(const struct dcmp_encoder *encoder, const struct dcmp_speed_limits *limits)
{
    const struct dcmp_window *window = &encoder->windows[window_too_fast(encoder, limits) % DCMP_WINDOWS];
    return nearest(middle_change(encoder, window->periods) * SECOND_US / window->us);
}

int32_t dcmp_encoder_travel(const struct dcmp_encoder *encoder)
{
    return nearest(middle_position(encoder) - encoder->origin);
}

int32_t dcmp_encoder_distance(const struct dcmp_encoder *encoder, int32_t origin_counts)
{
    const uint32_t origin = (uint32_t)origin_counts;
    return (int32_t)middle(difference(encoder->raw, origin), difference(encoder->raw_before, origin),
                           difference(encoder->raw_oldest, origin));
}
