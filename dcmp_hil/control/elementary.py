"""Elementary functions of the law: the same bits from every compiler and from Python (numerics 2).

They are made of additions, products, comparisons and exact scalings alone, which IEEE 754 defines to the last
bit; `firmware/core/dcmp_elementary.h` is the same text in C. The polynomials are minimax fits (Remez). The
reduction of the sine and of the exponential is that of Cody and Waite (Software Manual for the Elementary
Functions, 1980): a constant in parts, whose products with a small whole number are exact.
"""

from __future__ import annotations

from math import frexp, ldexp

NUMERICS = 2
"""Version of the arithmetic: results of the same version are the same to the bit on every computer."""

_ROUNDING = 6755399441055744.0  # 1.5 * 2**52: a sum with it has no bits left for a fraction
_WHOLE = 2251799813685248.0  # 2**51: from here on the sum with it is not exact

_SINE_MAX_RAD = 1073741824.0  # 2**30: one bit of it is 1e-7 rad
_ONE_OVER_PI = 0.3183098861837907
_PI_1, _PI_2, _PI_3 = 3.1415926534682512, 1.2154201012607932e-10, 4.044532497591901e-21  # 32, 32 and 53 bits
_HALF_PI = 1.5707963267948966

_EXPONENT_MAX = 700.0
_NO_SCALE = 0.34  # within half of ln 2
_ONE_OVER_LN2 = 1.4426950408889634
_LN2_1, _LN2_2 = 0.6931471805592082, 7.371002565167799e-13  # 40 and 53 bits
_E0, _E1, _E2, _E3 = 0.5, 0.16666666666666677, 0.0416666666666667, 0.008333333333321633
_E4, _E5, _E6, _E7 = (
    0.0013888888888866835, 0.0001984126988612949, 2.4801587360597383e-05, 2.7557244200044336e-06,
)  # fmt: skip
_E8, _E9, _E10 = 2.7557242700265607e-07, 2.5109041879068726e-08, 2.0924467674204327e-09

_L1, _L2, _L3, _L4 = 0.6666666666666735, 0.3999999999940942, 0.2857142874366239, 0.22222198432149784
_L5, _L6, _L7 = 0.1818357216161805, 0.15313837699209373, 0.14798198605116586
_ROOT_HALF = 0.7071067811865476

_C0, _C1, _C2, _C3 = 1.2370205743741491, -0.29720836448046895, 0.04589482882193578, -0.0025489133602668228
_DOUBLES = 2.0, 4.0, 8.0
_THIRD, _TWO_NINTHS, _FOURTEEN_81ST = 1 / 3, 2 / 9, 14 / 81  # series of (1 - h)**(-1/3)


def nearest(x: float) -> float:
    """Return the nearest whole number, half to even; x itself from 2**51 on, and NaN of NaN."""
    return (x + _ROUNDING) - _ROUNDING if -_WHOLE < x < _WHOLE else x


def floor(x: float) -> float:
    """Return the largest whole number that is not above x; x itself from 2**51 on, and NaN of NaN."""
    if not -_WHOLE < x < _WHOLE:
        return x
    n = (x + _ROUNDING) - _ROUNDING
    return n - 1.0 if n > x else n


def sine(x: float) -> float:
    """Return sin x, `x` in rad, to 2 units in the last place where the turns are below a million.

    0 beyond 2**30 rad, where one bit of x is 1e-7 rad; NaN for an argument that is not finite.
    """
    r, sign = x, 1.0
    if not -_HALF_PI <= x <= _HALF_PI:
        if not -_SINE_MAX_RAD < x < _SINE_MAX_RAD:
            return x - x
        n = (x * _ONE_OVER_PI + _ROUNDING) - _ROUNDING
        r = ((x - n * _PI_1) - n * _PI_2) - n * _PI_3
        half = 0.5 * n
        odd = half - ((half + _ROUNDING) - _ROUNDING)  # 0, or a half either way
        sign = 1.0 - 8.0 * odd * odd
    z = r * r
    # Numbers in the line: 0.03 us less than names.
    # fmt: off
    tail = -0.16666666666666666 + z * (0.00833333333333321 + z * (-0.00019841269841214512 + z * (
        2.755731921199205e-06 + z * (-2.505210694675562e-08 + z * (1.6058943226030913e-10 + z * (
            -7.643078395757952e-13 + z * 2.722044477790634e-15))))))
    # fmt: on
    return sign * (r + r * (z * tail))


def cosine(x: float) -> float:
    """Return cos x, `x` in rad, as the sine of what a quarter turn leaves: to 2e-16 and half a unit of x."""
    r = _HALF_PI - abs(x)
    if not r >= -_HALF_PI:
        return sine(r)
    z = r * r
    # The sine of r, in the line: 0.1 us less.
    # fmt: off
    tail = -0.16666666666666666 + z * (0.00833333333333321 + z * (-0.00019841269841214512 + z * (
        2.755731921199205e-06 + z * (-2.505210694675562e-08 + z * (1.6058943226030913e-10 + z * (
            -7.643078395757952e-13 + z * 2.722044477790634e-15))))))
    # fmt: on
    return r + r * (z * tail)


def _exponential(x: float) -> tuple[float, float]:
    """Return p = e**r - 1 and the scale 2**k, for x = k ln 2 + r, limited to +-700."""
    x = -_EXPONENT_MAX if x < -_EXPONENT_MAX else min(x, _EXPONENT_MAX)
    k = (x * _ONE_OVER_LN2 + _ROUNDING) - _ROUNDING
    r = (x - k * _LN2_1) - k * _LN2_2
    return r + r * r * _tail(r), ldexp(1.0, int(k))


def _tail(r: float) -> float:
    """Return (e**r - 1 - r) / r**2 for an r of half a ln 2 at most."""
    # fmt: off
    return _E0 + r * (_E1 + r * (_E2 + r * (_E3 + r * (_E4 + r * (_E5 + r * (_E6 + r * (
        _E7 + r * (_E8 + r * (_E9 + r * _E10)))))))))
    # fmt: on


def expm1(x: float) -> float:
    """Return e**x - 1 to 2 units in the last place; beyond +-700 that of 700, NaN of NaN."""
    if -_NO_SCALE <= x <= _NO_SCALE:  # k is 0, and the rest as below: a third less
        # fmt: off
        return x + x * x * (_E0 + x * (_E1 + x * (_E2 + x * (_E3 + x * (_E4 + x * (_E5 + x * (_E6 + x * (
            _E7 + x * (_E8 + x * (_E9 + x * _E10))))))))))
        # fmt: on
    if x != x:
        return x
    p, scale = _exponential(x)
    return scale * p + (scale - 1.0)


def exponential(x: float) -> float:
    """Return e**x to 2 units in the last place; beyond +-700 that of 700, NaN of NaN."""
    if -_NO_SCALE <= x <= _NO_SCALE:
        # fmt: off
        return 1.0 + (x + x * x * (_E0 + x * (_E1 + x * (_E2 + x * (_E3 + x * (_E4 + x * (_E5 + x * (_E6 + (
            x * (_E7 + x * (_E8 + x * (_E9 + x * _E10))))))))))))
        # fmt: on
    if x != x:
        return x
    p, scale = _exponential(x)
    return scale * p + scale


def inverse_cube_root(x: float) -> float:
    """Return x**(-1/3) to 2 units in the last place, for a positive normal number.

    A cubic starts within 2 %; two steps of the series of (1 - h)**(-1/3), h = 1 - x y**3, end it.
    """
    mantissa, exponent = frexp(x)
    third = (exponent + 1022) // 3
    m = mantissa * _DOUBLES[exponent + 1022 - 3 * third]  # in [1, 8)
    y = _C0 + m * (_C1 + m * (_C2 + m * _C3))
    h = 1.0 - m * (y * y * y)
    y = y + y * (h * (_THIRD + h * (_TWO_NINTHS + h * _FOURTEEN_81ST)))
    h = 1.0 - m * (y * y * y)
    y = y + y * (h * (_THIRD + h * _TWO_NINTHS))
    return ldexp(y, 341 - third)


def logarithm(x: float) -> float:
    """Return ln x to 1 unit in the last place, for a positive normal number.

    x = 2**k (1 + f), and ln(1 + f) by the series of its fraction f / (2 + f), as fdlibm has it (Sun, 1993).
    """
    m, exponent = frexp(x)
    small = m < _ROOT_HALF
    k = float(exponent - small)
    f = (m + m if small else m) - 1.0
    s = f / (2.0 + f)
    z = s * s
    tail = z * (_L1 + z * (_L2 + z * (_L3 + z * (_L4 + z * (_L5 + z * (_L6 + z * _L7))))))
    half_square = 0.5 * f * f
    return k * _LN2_1 - ((half_square - (s * (half_square + tail) + k * _LN2_2)) - f)
