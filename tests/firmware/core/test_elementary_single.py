"""Elementary functions in single precision: the bits of the same operations on arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tests.firmware.law import Law, same_bits

if TYPE_CHECKING:
    from tests.firmware.bench import Core

Singles = Any
"""Arrays of single precision: a constant of it keeps their type."""

F = np.float32
ROUNDING = F(1.5 * 2.0**23)
ANGLES = np.linspace(-3200.0, 3200.0, 20001, dtype=F)
EXPONENTS = np.linspace(-86.9, 86.9, 20001, dtype=F)
POSITIVE = (10.0 ** np.linspace(-37.0, 38.0, 20001)).astype(F)


def _nearest(x: Singles) -> Singles:
    return (x + ROUNDING) - ROUNDING


def _sine(x: Singles) -> Singles:
    n = _nearest(x * F(0.3183098861837907))
    r = ((x - n * F(3.141357421875)) - n * F(0.0002352297306060791)) - n * F(1.984187159361081e-09)
    half = F(0.5) * n
    odd, z = half - _nearest(half), r * r
    tail = F(-0.00019806546333711594) + z * F(2.599902700239909e-06)
    tail = F(0.008333016186952591) + z * tail
    tail = F(-0.16666656732559204) + z * tail
    return (F(1.0) - F(8.0) * odd * odd) * (r + r * (z * tail))


def _expm1(x: Singles) -> Singles:
    k = _nearest(x * F(1.4426950408889634))
    r = (x - k * F(0.693145751953125)) - k * F(1.4286068203094173e-06)
    tail = F(0.008366066962480545) + r * F(0.001389823155477643)
    tail = F(0.04166685417294502) + r * tail
    tail = F(0.1666654795408249) + r * tail
    tail = F(0.5) + r * tail
    scale = np.ldexp(F(1.0), k.astype(np.int32)).astype(F)
    return scale * (r + r * r * tail) + (scale - F(1.0))


def _inverse_cube_root(x: Singles) -> Singles:
    y = (np.uint32(0x54A1F5B0) - x.view(np.uint32) // np.uint32(3)).view(F)
    h = F(1.0) - x * y * y * y
    y = y + y * (h * (F(1.0 / 3.0) + h * (F(2.0 / 9.0) + h * F(14.0 / 81.0))))
    h = F(1.0) - x * y * y * y
    return y + y * (h * F(1.0 / 3.0))


def test_single_precision_has_the_bits_of_its_operations(core: Core) -> None:
    law = Law(core, "float_")
    for name, function, x in (
        ("sine", _sine, ANGLES),
        ("expm1", _expm1, EXPONENTS),
        ("inverse_cube_root", _inverse_cube_root, POSITIVE),
    ):
        wanted = function(x)
        assert wanted.dtype == F
        assert same_bits(law(name, x.astype(float)), wanted.astype(float)), name


def test_cube_root_of_what_is_not_positive(core: Core) -> None:
    law = Law(core, "float_")
    given = np.array([0.0, -1.0, -1e-30, -np.inf])
    assert same_bits(law("inverse_cube_root", given), given.astype(F).astype(float))
    assert np.isnan(law("inverse_cube_root", np.array([np.nan])))
