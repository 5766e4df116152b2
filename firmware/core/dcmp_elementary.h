/* Elementary functions of the law without a library: additions, products, comparisons and exact scalings alone.
 * dcmp_hil/control/elementary.py has the same operations in the same order, and says where they come from.
 * No branches: a loop over lanes becomes vector instructions. */
#ifndef DCMP_ELEMENTARY_H
#define DCMP_ELEMENTARY_H

#include <stdbool.h>

#include "dcmp_real.h"

/* The absolute value. */
static inline real dcmp_magnitude(real x)
{
    return x < REAL(0.0) ? -x : x;
}

/* Whether it is a number, and no infinity. */
static inline bool dcmp_is_finite(real x)
{
    return x - x == REAL(0.0);
}

/* The square root, which IEEE 754 defines to the last bit. Compile with -fno-math-errno: then it is one instruction. */
static inline real dcmp_square_root(real x)
{
    return DCMP_SQUARE_ROOT(x);
}

/* The nearest whole number, for less than DCMP_WHOLE either way. */
static inline real dcmp_nearest(real x)
{
    return (x + DCMP_ROUNDING) - DCMP_ROUNDING;
}

/* The largest whole number that is not above x; NaN of NaN. */
static inline real dcmp_floor(real x)
{
    const real n = dcmp_nearest(x);
    const real below = n - REAL(1.0);
    const real whole = n > x ? below : n;
    return dcmp_magnitude(x) < DCMP_WHOLE ? whole : x;
}

/* (sin r - r) / (r z), z = r^2, for r from -pi/2 to pi/2. Single precision needs four coefficients: those whose largest error is
 * least, 5e-9. */
static inline real dcmp_sine_tail(real z)
{
#ifdef DCMP_REAL_FLOAT
    real tail = REAL(-0.00019806546333711594) + z * REAL(2.599902700239909e-06);
    tail = REAL(0.008333016186952591) + z * tail;
    return REAL(-0.16666656732559204) + z * tail;
#else
    real tail = REAL(-7.643078395757952e-13) + z * REAL(2.722044477790634e-15);
    tail = REAL(1.6058943226030913e-10) + z * tail;
    tail = REAL(-2.505210694675562e-08) + z * tail;
    tail = REAL(2.755731921199205e-06) + z * tail;
    tail = REAL(-0.00019841269841214512) + z * tail;
    tail = REAL(0.00833333333333321) + z * tail;
    return REAL(-0.16666666666666666) + z * tail;
#endif
}

/* sin x, for x that is within DCMP_SINE_MAX, rad, or NaN. */
static inline real dcmp_sine_within(real x)
{
    const real n = dcmp_nearest(x * REAL(0.3183098861837907));
    const real r = ((x - n * DCMP_PI_1) - n * DCMP_PI_2) - n * DCMP_PI_3;
    const real half = REAL(0.5) * n;
    const real odd = half - dcmp_nearest(half); /* 0, or a half either way */
    const real z = r * r;
    return (REAL(1.0) - REAL(8.0) * odd * odd) * (r + r * (z * dcmp_sine_tail(z)));
}

/* sin x, x in rad: 0 beyond DCMP_SINE_MAX, NaN for an argument that is not finite. */
static inline real dcmp_sine(real x)
{
    const real sine = dcmp_sine_within(x);
    const real none = x - x;
    return dcmp_magnitude(x) < DCMP_SINE_MAX ? sine : none;
}

/* cos x, x in rad. */
static inline real dcmp_cosine(real x)
{
    return dcmp_sine(REAL(1.5707963267948966) - dcmp_magnitude(x));
}

/* e^x = scale (1 + p). */
struct dcmp_exponential {
    real p;
    real scale;
};

/* (e^r - 1 - r) / r^2, for r from -ln 2 / 2 to ln 2 / 2. Single precision needs half of the coefficients, as above: 1.4e-8. */
static inline real dcmp_exponential_tail(real r)
{
#ifdef DCMP_REAL_FLOAT
    real tail = REAL(0.008366066962480545) + r * REAL(0.001389823155477643);
    tail = REAL(0.04166685417294502) + r * tail;
    tail = REAL(0.1666654795408249) + r * tail;
#else
    real tail = REAL(2.5109041879068726e-08) + r * REAL(2.0924467674204327e-09);
    tail = REAL(2.7557242700265607e-07) + r * tail;
    tail = REAL(2.7557244200044336e-06) + r * tail;
    tail = REAL(2.4801587360597383e-05) + r * tail;
    tail = REAL(0.0001984126988612949) + r * tail;
    tail = REAL(0.0013888888888866835) + r * tail;
    tail = REAL(0.008333333333321633) + r * tail;
    tail = REAL(0.0416666666666667) + r * tail;
    tail = REAL(0.16666666666666677) + r * tail;
#endif
    return REAL(0.5) + r * tail;
}

/* The parts of e^x, for x that is within +-DCMP_EXPONENT_MAX, or NaN. */
static inline struct dcmp_exponential dcmp_exponential_within(real x)
{
    const real sum = x * REAL(1.4426950408889634) + DCMP_ROUNDING;
    const real k = sum - DCMP_ROUNDING;
    const real r = (x - k * DCMP_LN2_1) - k * DCMP_LN2_2;
    /* The last bits of the sum are those of k. */
    const union dcmp_bits whole = {.number = sum};
    const union dcmp_bits scale = {.word = (whole.word + DCMP_EXPONENT_BIAS) << DCMP_MANTISSA_BITS};
    const struct dcmp_exponential parts = {r + r * r * dcmp_exponential_tail(r), scale.number};
    return parts;
}

/* x limited to +-DCMP_EXPONENT_MAX; NaN of NaN. */
static inline real dcmp_exponent(real x)
{
    const real above = x > DCMP_EXPONENT_MAX ? DCMP_EXPONENT_MAX : x;
    return x < -DCMP_EXPONENT_MAX ? -DCMP_EXPONENT_MAX : above;
}

/* e^x - 1, for x that is within +-DCMP_EXPONENT_MAX, or NaN. */
static inline real dcmp_expm1_within(real x)
{
    const struct dcmp_exponential parts = dcmp_exponential_within(x);
    return parts.scale * parts.p + (parts.scale - REAL(1.0));
}

/* e^x - 1; NaN of NaN. */
static inline real dcmp_expm1(real x)
{
    return dcmp_expm1_within(dcmp_exponent(x));
}

/* e^x; NaN of NaN. */
static inline real dcmp_exp(real x)
{
    const struct dcmp_exponential parts = dcmp_exponential_within(dcmp_exponent(x));
    return parts.scale * parts.p + parts.scale;
}

/* ln x, for a positive normal number: x = 2^k (1 + f). */
static inline real dcmp_logarithm(real x)
{
    const union dcmp_bits bits = {.number = x};
    const union dcmp_bits rounding = {.number = DCMP_ROUNDING};
    const union dcmp_bits sum = {.word = rounding.word + (bits.word >> DCMP_MANTISSA_BITS)};
    const real exponent = (sum.number - DCMP_ROUNDING) - (REAL(DCMP_EXPONENT_BIAS) - REAL(1.0));
    const dcmp_word mantissa = bits.word & DCMP_MANTISSA;
    const union dcmp_bits reduced = {.word = mantissa | ((DCMP_EXPONENT_BIAS - 1u) << DCMP_MANTISSA_BITS)};
    const real m = reduced.number; /* in [0.5, 1) */
    const real below = exponent - REAL(1.0);
    const real twice = m + m;
    const real k = m < DCMP_ROOT_HALF ? below : exponent;
    const real f = (m < DCMP_ROOT_HALF ? twice : m) - REAL(1.0);
    const real s = f / (REAL(2.0) + f);
    const real z = s * s;
    real tail = REAL(0.15313837699209373) + z * REAL(0.14798198605116586);
    tail = REAL(0.1818357216161805) + z * tail;
    tail = REAL(0.22222198432149784) + z * tail;
    tail = REAL(0.2857142874366239) + z * tail;
    tail = REAL(0.3999999999940942) + z * tail;
    tail = z * (REAL(0.6666666666666735) + z * tail);
    const real half_square = REAL(0.5) * f * f;
    return k * DCMP_LN2_1 - ((half_square - (s * (half_square + tail) + k * DCMP_LN2_2)) - f);
}

#ifdef DCMP_REAL_FLOAT

/* x^(-1/3), for a positive normal number; NaN of NaN. A third of the bits, taken from a constant, is the root within 4 %. */
static inline real dcmp_inverse_cube_root(real x)
{
    const union dcmp_bits bits = {.number = x};
    const union dcmp_bits guess = {.word = 0x54A1F5B0u - bits.word / 3u};
    real y = guess.number;
    real h = REAL(1.0) - x * y * y * y;
    y = y + y * (h * (REAL(1.0 / 3.0) + h * (REAL(2.0 / 9.0) + h * REAL(14.0 / 81.0))));
    h = REAL(1.0) - x * y * y * y;
    y = y + y * (h * REAL(1.0 / 3.0));
    return x > REAL(0.0) ? y : x;
}

#else

#define DCMP_ROOT_SCALE 341u /* a third of the exponent's bias */

/* x^(-1/3), for a positive normal number; NaN of NaN. */
static inline real dcmp_inverse_cube_root(real x)
{
    const union dcmp_bits bits = {.number = x};
    const dcmp_word exponent = bits.word >> DCMP_MANTISSA_BITS;
    const dcmp_word third = (exponent * 21846u) >> 16;
    const dcmp_word rest = exponent - third * 3u;
    const dcmp_word mantissa = bits.word & DCMP_MANTISSA;
    const union dcmp_bits reduced = {.word = mantissa | ((DCMP_EXPONENT_BIAS + rest) << DCMP_MANTISSA_BITS)};
    const union dcmp_bits scale = {.word = (DCMP_EXPONENT_BIAS + DCMP_ROOT_SCALE - third) << DCMP_MANTISSA_BITS};
    const real m = reduced.number; /* in [1, 8) */
    real y = REAL(0.04589482882193578) + m * REAL(-0.0025489133602668228);
    y = REAL(-0.29720836448046895) + m * y;
    y = REAL(1.2370205743741491) + m * y;
    real h = REAL(1.0) - m * (y * y * y);
    y = y + y * (h * (REAL(1.0 / 3.0) + h * (REAL(2.0 / 9.0) + h * REAL(14.0 / 81.0))));
    h = REAL(1.0) - m * (y * y * y);
    y = y + y * (h * (REAL(1.0 / 3.0) + h * REAL(2.0 / 9.0)));
    const real root = y * scale.number;
    return x > REAL(0.0) ? root : x;
}

#endif

#endif
