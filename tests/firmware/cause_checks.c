#include "dcmp_cause.h"
#include "law_checks.h"

void CHECK(leaves_time)(const double *causes, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        out[i] = dcmp_leaves_time((enum dcmp_cause)(int32_t)causes[i]) ? 1.0 : 0.0;
    }
}
