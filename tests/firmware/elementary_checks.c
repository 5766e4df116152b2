#include "dcmp_elementary.h"
#include "law_checks.h"

#define COLUMN(name, function)                                        \
    void CHECK(name)(const double *x, double *out, uint32_t n)        \
    {                                                                 \
        for (uint32_t i = 0; i < n; i++) {                            \
            out[i] = (double)function((real)x[i]);                    \
        }                                                             \
    }

COLUMN(magnitude, dcmp_magnitude)
COLUMN(is_finite, dcmp_is_finite)
COLUMN(square_root, dcmp_square_root)
COLUMN(nearest, dcmp_nearest)
COLUMN(floor, dcmp_floor)
COLUMN(sine, dcmp_sine)
COLUMN(cosine, dcmp_cosine)
COLUMN(expm1, dcmp_expm1)
COLUMN(exponential, dcmp_exp)
COLUMN(logarithm, dcmp_logarithm)
COLUMN(inverse_cube_root, dcmp_inverse_cube_root)
