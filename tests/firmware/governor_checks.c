#include "dcmp_governor.h"
#include "law_checks.h"

static struct dcmp_bounds bounds_of(const double *x)
{
    const struct dcmp_bounds bounds = {(real)x[0], (real)x[1], (real)x[2], (real)x[3], (real)x[4], (real)x[5]};
    return bounds;
}

static void put(double *out, const struct dcmp_governed *governed)
{
    out[0] = (double)governed->reference.position;
    out[1] = (double)governed->reference.velocity;
    out[2] = (double)governed->reference.acceleration;
    out[3] = governed->own ? 1.0 : 0.0;
    out[4] = governed->next.leads ? 1.0 : 0.0;
}

void CHECK(governor)(const double *setup, double period, const double *rows, double *out, uint32_t n)
{
    struct dcmp_governor governor = {0};
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[4u * i];
        const struct dcmp_reference asked = {(real)x[1], (real)x[2], (real)x[3]};
        const struct dcmp_governed governed =
            dcmp_governor_bound(governor, bounds_of(setup), asked, (int64_t)x[0], (real)period);
        governor = governed.next;
        put(&out[5u * i], &governed);
    }
}

void CHECK(led)(const double *setup, double period, const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const double *x = &rows[7u * i];
        const struct dcmp_reference asked = {(real)x[4], (real)x[5], (real)x[6]};
        const struct dcmp_governor leading = {
            .last = {(real)x[1], (real)x[2], (real)x[3]}, .began = true, .has_last = true, .leads = true};
        const struct dcmp_governed governed =
            dcmp_governor_bound(leading, bounds_of(setup), asked, (int64_t)x[0], (real)period);
        put(&out[5u * i], &governed);
    }
}
