"""Counted random numbers: the published answers, and the distributions that they have."""

import math
import statistics

import pytest

from dcmp_hil.control.counted_random import ENCODER_NOISE, LOST_SAMPLES, CountedRandom, philox, philox_keys
from dcmp_hil.control.elementary import logarithm

_ONES = 0xFFFF_FFFF
_ANSWERS = [  # kat_vectors of Random123: block, key, result
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((_ONES, _ONES, _ONES, _ONES), (_ONES, _ONES), (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("block", "key", "result"), _ANSWERS)
def test_the_published_answers_of_philox(
    block: tuple[int, int, int, int], key: tuple[int, int], result: tuple[int, int, int, int]
) -> None:
    assert philox(block, philox_keys(*key)) == result


def test_seed_stream_and_counter_each_make_other_numbers() -> None:
    numbers = [
        CountedRandom(seed, stream).words(counter)
        for seed in (1, 2, 2**32)
        for stream in (ENCODER_NOISE, LOST_SAMPLES)
        for counter in (0, 1, 2**32)
    ]
    assert len(set(numbers)) == len(numbers)


def test_uniform_numbers_fill_their_range_evenly() -> None:
    draws = [CountedRandom(3, 0).uniform(n) for n in range(20_000)]
    assert 0.0 <= min(draws) < max(draws) < 1.0
    assert statistics.fmean(draws) == pytest.approx(0.5, abs=0.008)  # 4 standard errors
    assert statistics.pvariance(draws) == pytest.approx(1 / 12, abs=0.0025)


def test_normal_numbers_have_the_moments_of_a_normal_distribution() -> None:
    draws = [CountedRandom(3, 0).normal(n) for n in range(20_000)]
    assert statistics.fmean(draws) == pytest.approx(0.0, abs=0.03)
    assert statistics.pstdev(draws) == pytest.approx(1.0, abs=0.02)
    for sigma in (0.5, 1.0, 2.0, 3.0):
        inside = sum(abs(draw) < sigma for draw in draws) / len(draws)
        share = math.erf(sigma / math.sqrt(2.0))
        assert inside == pytest.approx(share, abs=4.0 * math.sqrt(share * (1.0 - share) / len(draws)))


def test_the_logarithm_is_exact_to_one_unit_in_the_last_place() -> None:
    uniform = CountedRandom(4, 0).uniform
    for n in range(5000):
        x = math.ldexp(0.5 + uniform(n), n % 200 - 100)
        assert abs(logarithm(x) - math.log(x)) <= math.ulp(math.log(x))
    assert logarithm(1.0) == 0.0
    assert logarithm(2.0**-53) == math.log(2.0**-53)
