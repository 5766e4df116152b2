#include "motion.h"

#define US 1000000

static int64_t size(int64_t value)
{
    return value < 0 ? -value : value;
}

/* 24 bits as a signed number. */
static int32_t shortest(uint32_t difference)
{
    const uint32_t low = difference & 0xFFFFFFu;
    return low >= 0x800000u ? (int32_t)low - 0x1000000 : (int32_t)low;
}

static int32_t fitting(int64_t value)
{
    const int64_t most = value < INT32_MIN ? INT32_MIN : value;
    return (int32_t)(most > INT32_MAX ? INT32_MAX : most);
}

static int64_t ago(const struct motion *motion, uint32_t ticks)
{
    return motion->at[(motion->newest - ticks) % MOTION_PAST];
}

static int64_t median(int64_t a, int64_t b, int64_t c)
{
    if ((a <= b && b <= c) || (c <= b && b <= a)) {
        return b;
    }
    return (b <= a && a <= c) || (c <= a && a <= b) ? a : c;
}

void motion_tick(struct motion *motion, uint32_t counts, int64_t built_speed, int64_t period_us)
{
    const int32_t one = motion->begun ? shortest(counts - motion->counts[0]) : 0;
    const int32_t two = motion->begun ? shortest(counts - motion->counts[1]) : 0;
    const bool jumped_before = motion->jumped;
    int64_t now = ago(motion, 0);
    motion->tick++;
    motion->jumped = size(one) > 8 && size(one) * US > 4 * built_speed * period_us;
    if (motion->jumped) {
        motion->jump = one;
        motion->jumps[2] = motion->jumps[1];
        motion->jumps[1] = motion->jumps[0];
        motion->jumps[0] = motion->tick;
    }
    if ((motion->jumped || jumped_before) && (size(two) - 2) * US <= 2 * built_speed * period_us) {
        now = ago(motion, 1) + two;
    } else if (!motion->jumped) {
        now += one;
    }
    for (uint32_t i = 2; i > 0u; i--) {
        motion->counts[i] = motion->begun ? motion->counts[i - 1u] : counts & 0xFFFFFFu;
    }
    motion->counts[0] = counts & 0xFFFFFFu;
    motion->begun = true;
    motion->newest++;
    motion->at[motion->newest % MOTION_PAST] = now;
}

static int64_t position(const struct motion *motion)
{
    return median(ago(motion, 0), ago(motion, 1), ago(motion, 2));
}

void motion_arm(struct motion *motion)
{
    if (!motion->placed) {
        motion->placed = true;
        motion->origin = position(motion);
    }
}

/* The change over so many ticks, the middle one of those that the newest three end with. */
static int64_t moved(const struct motion *motion, uint32_t ticks)
{
    int64_t changes[3];
    for (uint32_t end = 0; end < 3u; end++) {
        changes[end] = ago(motion, end) - ago(motion, end + ticks);
    }
    return median(changes[0], changes[1], changes[2]);
}

static uint32_t whole_ticks(int64_t us, int64_t period_us)
{
    return (uint32_t)((us + period_us - 1) / period_us);
}

/* Over 1 ms, twice as many ticks, 8 ms: by how many counts may it be more than the speed says. A session's speed holds
 * over the last of them, the board's own over the others. */
static struct motion_fault too_fast(const struct motion *motion, const struct motion_limits *limits)
{
    const uint32_t millisecond = whole_ticks(1000, limits->period_us);
    const uint32_t times[3] = {millisecond, 2u * millisecond, whole_ticks(8000, limits->period_us)};
    static const int64_t counts[3] = {1, 2, 1};
    struct motion_fault fault = {0, 0};
    for (uint32_t i = 0; i < 3u && fault.code == 0u; i++) {
        const int64_t way = moved(motion, times[i]);
        const int64_t time_us = times[i] * limits->period_us;
        if ((size(way) - counts[i]) * US > (i == 2u ? limits->speed : limits->built_speed) * time_us) {
            fault.code = 5;
            fault.detail = fitting(way * US / time_us);
        }
    }
    return fault;
}

/* From the session's origin and, independently of it, from the first arming. */
static struct motion_fault too_far(const struct motion *motion, const struct motion_limits *limits)
{
    const bool given = limits->origin >= 0;
    const uint32_t origin = (uint32_t)limits->origin;
    const int64_t from_origin = median(shortest(motion->counts[0] - origin), shortest(motion->counts[1] - origin),
                                       shortest(motion->counts[2] - origin));
    const int64_t travel = position(motion) - motion->origin;
    struct motion_fault fault = {0, 0};
    if (given && size(from_origin) > limits->travel) {
        fault.code = 6;
        fault.detail = fitting(from_origin);
    } else if (size(travel) > (given ? limits->built_travel : limits->travel)) {
        fault.code = 6;
        fault.detail = fitting(travel);
    }
    return fault;
}

struct motion_fault motion_judge(const struct motion *motion, const struct motion_limits *limits)
{
    struct motion_fault fault = {0, 0};
    if (motion->jumped && motion->jumps[2] != 0u && motion->tick - motion->jumps[2] < MOTION_JUMPS) {
        fault.code = 7;
        fault.detail = motion->jump;
        return fault;
    }
    fault = too_fast(motion, limits);
    return fault.code != 0u ? fault : too_far(motion, limits);
}
