#include "dcmp_trajectory.h"
#include "law_checks.h"

static void put(double *out, struct dcmp_trajectory now, struct dcmp_moment moment, real soft_start, const double *row)
{
    const struct dcmp_reference reference = {(real)row[0], (real)row[1], (real)row[2]};
    const struct dcmp_reference got = dcmp_trajectory_at(now, moment, soft_start, reference);
    out[0] = (double)got.position;
    out[1] = (double)got.velocity;
    out[2] = (double)got.acceleration;
}

void CHECK(trajectory)(const double *setup, const double *rows, double *out, uint32_t n)
{
    const real period = (real)setup[0];
    const real soft_start = (real)setup[1];
    const real later = (real)setup[2];
    const int64_t begins = (int64_t)setup[3];
    const struct dcmp_trajectory first = {0};
    struct dcmp_trajectory now = dcmp_trajectory_hold(first, (real)setup[4]);
    int64_t before = 0;
    for (uint32_t i = 0; i < n; i++, rows += 10, out += 9) {
        const int64_t tick = (int64_t)rows[0];
        if (tick >= begins && !now.begun) {
            now = dcmp_trajectory_begin(tick, (real)setup[5]);
        }
        put(&out[0], now, dcmp_moment_after(now, tick, later, soft_start, period), soft_start, &rows[1]);
        put(&out[3], now, dcmp_moment_after(now, tick, REAL(0.0), soft_start, period), soft_start, &rows[4]);
        put(&out[6], now, dcmp_moment_between(now, before, tick, soft_start, period), soft_start, &rows[7]);
        before = tick;
    }
}
