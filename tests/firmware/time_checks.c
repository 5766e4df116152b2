#include "dcmp_time.h"
#include "law_checks.h"

void CHECK(instant)(double period, const double *ticks, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        out[i] = (double)dcmp_instant((int64_t)ticks[i], (real)period);
    }
}

void CHECK(elapsed)(double period, const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++, rows += 2) {
        out[i] = (double)dcmp_elapsed((int64_t)rows[0], (int64_t)rows[1], (real)period);
    }
}

void CHECK(lasting)(const double *setup, const double *ticks, double *out, uint32_t n)
{
    struct dcmp_lasting lasting = {0};
    for (uint32_t i = 0; i < n; i++) {
        lasting = dcmp_holds(lasting, (int64_t)ticks[i], (real)setup[1], (real)setup[0]);
        out[i] = dcmp_lasts(lasting, (real)setup[2], (real)setup[0]) ? 1.0 : 0.0;
    }
}

void CHECK(telling)(const double *setup, const double *ticks, double *out, uint32_t n)
{
    struct dcmp_told told = {0};
    for (uint32_t i = 0; i < n; i++) {
        const bool tells = dcmp_may_tell(told, (int64_t)ticks[i], (real)setup[1], (real)setup[0]);
        out[i] = tells ? 1.0 : 0.0;
        if (tells) {
            told.last = (int64_t)ticks[i];
            told.ever = true;
        }
    }
}
