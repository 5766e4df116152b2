#include "dcmp_random.h"
#include "law_checks.h"

void CHECK(philox)(const double *rows, double *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++, rows += 6, out += 4) {
        const struct dcmp_random_words block = {(uint32_t)rows[0], (uint32_t)rows[1], (uint32_t)rows[2],
                                                (uint32_t)rows[3]};
        const struct dcmp_random_key key = {(uint32_t)rows[4], (uint32_t)rows[5]};
        const struct dcmp_random_words words = dcmp_philox(block, key);
        out[0] = words.a;
        out[1] = words.b;
        out[2] = words.c;
        out[3] = words.d;
    }
}

void CHECK(random)(uint64_t seed, uint32_t stream, const double *counters, double *out, uint32_t n)
{
    const struct dcmp_random_key key = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    for (uint32_t i = 0; i < n; i++, out += 2) {
        out[0] = (double)dcmp_random_uniform(key, stream, (uint64_t)counters[i]);
        out[1] = (double)dcmp_random_normal(key, stream, (uint64_t)counters[i]);
    }
}
