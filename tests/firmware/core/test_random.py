"""Counted random numbers in C: the published answers, and the bits of dcmp_hil.control.counted_random."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.control.counted_random import CountedRandom
from tests.firmware.law import Law, same_bits

if TYPE_CHECKING:
    from tests.firmware.bench import Core

ONES = 0xFFFF_FFFF
ANSWERS = {  # kat_vectors of Random123: block and key
    (0, 0, 0, 0, 0, 0): (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8),
    (ONES,) * 6: (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD),
    (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344, 0xA4093822, 0x299F31D0): (
        *(0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
}
COUNTERS = np.array([*range(1000), 2**32 - 1, 2**32, 2**53], float)


def test_the_published_answers_of_philox(core: Core) -> None:
    got = Law(core)("philox", np.array(list(ANSWERS), float), width=4)
    assert got.astype(int).tolist() == [list(answer) for answer in ANSWERS.values()]


@pytest.mark.parametrize("seed", [0, 1, 2**32, 2**64 - 1])
@pytest.mark.parametrize("stream", [0, 1, 2**32 - 1])
def test_same_bits_as_python(core: Core, seed: int, stream: int) -> None:
    numbers = CountedRandom(seed, stream)
    wanted = [(numbers.uniform(n), numbers.normal(n)) for n in COUNTERS.astype(int).tolist()]
    assert same_bits(Law(core)("random", seed, stream, COUNTERS, width=2), np.array(wanted))


def test_single_precision_has_the_first_24_bits(core: Core) -> None:
    """The normal number by the logarithm's slope: next to 0 it is what 24 bits leave of it."""
    single = Law(core, "float_")("random", 3, 0, COUNTERS, width=2)
    double = Law(core)("random", 3, 0, COUNTERS, width=2)
    assert np.array_equal(single[:, 0], np.floor(double[:, 0] * 2.0**24) / 2.0**24)
    assert np.abs(single[:, 1] - double[:, 1]).max() < 1e-3
