"""A range holds what its words say."""

from __future__ import annotations

import math

import pytest

from dcmp_hil.common.number_range import NumberRange

RANGES = {
    NumberRange(): "a number",
    NumberRange(0.0, 1.0): "a number, at least 0 and at most 1",
    NumberRange(0.0, 1e9, low_excluded=True): "a number, above 0 and at most 1000000000",
    NumberRange(1e-6, 2.5, high_excluded=True): "a number, at least 1e-06 and below 2.5",
    NumberRange(low=-3.0): "a number, at least -3",
}


@pytest.mark.parametrize(("allowed", "words"), RANGES.items())
def test_words_name_both_bounds(allowed: NumberRange, words: str) -> None:
    assert allowed.words() == words


def test_words_name_unit_and_type() -> None:
    assert NumberRange(0.0, 500.0).words("ms") == "a number in ms, at least 0 and at most 500"
    assert NumberRange(low=1).words(what="a whole number") == "a whole number, at least 1"


@pytest.mark.parametrize("allowed", RANGES)
def test_a_bound_is_held_unless_it_is_excluded_and_beyond_it_nothing_is(allowed: NumberRange) -> None:
    for end, excluded, outwards in (
        (allowed.low, allowed.low_excluded, -math.inf),
        (allowed.high, allowed.high_excluded, math.inf),
    ):
        if math.isfinite(end):
            assert allowed.holds(end) != excluded
            assert allowed.holds(math.nextafter(end, -outwards))
            assert not allowed.holds(math.nextafter(end, outwards))


@pytest.mark.parametrize("allowed", RANGES)
def test_no_range_holds_nan(allowed: NumberRange) -> None:
    assert not allowed.holds(math.nan)
