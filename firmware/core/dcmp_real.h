/* The numbers of the law: double on a computer, float on a chip without double (DCMP_REAL_FLOAT).
 * Compile with -ffp-contract=off: then every compiler, instruction set and number of lanes gives the same bits.
 * -fno-math-errno and -fno-trapping-math change none, and let gcc make vector instructions of loops over lanes. */
#ifndef DCMP_REAL_H
#define DCMP_REAL_H

#include <stdint.h>

#ifdef __FAST_MATH__
#error "The law needs IEEE 754 as it stands: compile it without -ffast-math."
#endif
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0
#error "The law needs every operation rounded to its type: compile it with -mfpmath=sse."
#endif

#ifdef DCMP_REAL_FLOAT
typedef float real;
typedef uint32_t dcmp_word;

#define DCMP_MANTISSA_BITS 23
#define DCMP_EXPONENT_BIAS ((dcmp_word)127)
#define DCMP_ROUNDING REAL(0x1.8p23)   /* a sum with it has no bits left for a fraction */
#define DCMP_WHOLE REAL(0x1p22)        /* from here on the sum with it is not exact */
#define DCMP_SINE_MAX REAL(65536.0)    /* rad; beyond 3216 rad the sine is that of x within half a bit of it */
#define DCMP_PI_1 REAL(3.141357421875) /* pi in parts: 14 bits, and the rest */
#define DCMP_PI_2 REAL(0.0002352297306060791)
#define DCMP_PI_3 REAL(1.984187159361081e-09)
#define DCMP_EXPONENT_MAX REAL(87.0)
#define DCMP_LN2_1 REAL(0.693145751953125) /* ln 2 in parts: 16 bits, and the rest */
#define DCMP_LN2_2 REAL(1.4286068203094173e-06)
#define DCMP_SQUARE_ROOT __builtin_sqrtf
#define DCMP_RANDOM_UNIT REAL(0x1p-24)
#else
typedef double real;
typedef uint64_t dcmp_word;

#define DCMP_MANTISSA_BITS 52
#define DCMP_EXPONENT_BIAS ((dcmp_word)1023)
#define DCMP_ROUNDING REAL(0x1.8p52)
#define DCMP_WHOLE REAL(0x1p51)
#define DCMP_SINE_MAX REAL(1073741824.0) /* rad; one bit of it is 1e-7 rad */
#define DCMP_PI_1 REAL(3.1415926534682512) /* 32, 32 and 53 bits */
#define DCMP_PI_2 REAL(1.2154201012607932e-10)
#define DCMP_PI_3 REAL(4.044532497591901e-21)
#define DCMP_EXPONENT_MAX REAL(700.0)
#define DCMP_LN2_1 REAL(0.6931471805592082) /* 40 and 53 bits */
#define DCMP_LN2_2 REAL(7.371002565167799e-13)
#define DCMP_SQUARE_ROOT __builtin_sqrt
#define DCMP_RANDOM_UNIT REAL(0x1p-53)
#endif

#define DCMP_MANTISSA ((((dcmp_word)1) << DCMP_MANTISSA_BITS) - 1u)

/* A constant of the type. */
#define REAL(number) ((real)(number))

#define DCMP_ROOT_HALF REAL(0.7071067811865476)

/* A number and its bits. */
union dcmp_bits {
    real number;
    dcmp_word word;
};

#endif
