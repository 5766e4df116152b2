"""Lag, noise and variation of signals that are known."""

from __future__ import annotations

import numpy as np
import pytest

from dcmp_hil.comparison import even_pieces, lag, noise, variation
from tests.helpers import known

PERIOD = 1e-3
TIME = np.arange(0.0, 8.0, PERIOD)
RNG = np.random.default_rng(5)


def swing(t: np.ndarray) -> np.ndarray:
    """Return a velocity like that of the bench rig."""
    return np.asarray(0.8 * np.sin(0.5 * t) + 0.1 * np.sin(3.0 * t + 1.0))


@pytest.mark.parametrize("late", [0.0, 1e-3, 0.35e-3, 7.25e-3, 60.5e-3, 0.2, -2.5e-3])
def test_a_known_delay_is_found_to_a_microsecond(late: float) -> None:
    found = known(lag([(swing(TIME - late), swing(TIME))], PERIOD, 15.0))
    assert found == pytest.approx(late, abs=1e-6)


def test_noise_hardly_changes_the_lag() -> None:
    signal = swing(TIME - 12.3e-3) + 0.05 * RNG.standard_normal(len(TIME))
    assert known(lag([(signal, swing(TIME))], PERIOD, 15.0)) == pytest.approx(12.3e-3, abs=3e-3)


def test_the_steps_of_an_encoder_do_not_pull_the_lag_towards_themselves() -> None:
    count, bandwidth = 2.0 * np.pi / 4096, 60.0
    position = -1.6 * np.cos(0.5 * TIME)
    counted = np.round(position / count) * count
    slow = np.zeros(len(TIME))
    for k in range(1, len(TIME)):
        rate = (counted[k] - counted[k - 1]) / PERIOD
        slow[k] = slow[k - 1] + (1.0 - np.exp(-bandwidth * PERIOD)) * (rate - slow[k - 1])
    found = known(lag([(slow[500:], 0.8 * np.sin(0.5 * TIME[500:]))], PERIOD, 15.0))
    assert found == pytest.approx(1.0 / bandwidth, abs=1e-3)


def test_pieces_have_one_lag_together() -> None:
    signal, true = swing(TIME - 4.5e-3), swing(TIME)
    cuts = [slice(0, 3000), slice(3500, 8000)]
    assert known(lag([(signal[cut], true[cut]) for cut in cuts], PERIOD, 15.0)) == pytest.approx(
        4.5e-3, abs=1e-6
    )


def test_a_low_pass_of_first_order_is_late_by_its_time_constant() -> None:
    slow, bandwidth = np.zeros(len(TIME)), 60.0
    for k in range(1, len(TIME)):
        slow[k] = slow[k - 1] + (1.0 - np.exp(-bandwidth * PERIOD)) * (swing(TIME[k]) - slow[k - 1])
    assert known(lag([(slow[1000:], swing(TIME)[1000:])], PERIOD, 15.0)) == pytest.approx(
        1.0 / bandwidth, abs=1e-3
    )


@pytest.mark.parametrize(
    "true",
    [np.zeros(len(TIME)), np.full(len(TIME), 0.7), RNG.standard_normal(len(TIME)), swing(TIME - 0.6)],
    ids=["rest", "constant", "noise", "too late"],
)
def test_there_is_no_lag_where_no_shift_makes_the_two_alike(true: np.ndarray) -> None:
    signal = swing(TIME) if true[5] == swing(TIME - 0.6)[5] else RNG.standard_normal(len(TIME))
    assert lag([(signal, true)], PERIOD, 15.0) is None


def test_there_is_no_lag_of_nothing() -> None:
    assert lag([], PERIOD, 15.0) is None
    assert lag([(np.ones(3), np.ones(3))], PERIOD, 15.0) is None


def test_noise_is_what_lies_above_the_corner() -> None:
    slow, fast = swing(TIME), 0.03 * np.sin(2.0 * np.pi * 100.0 * TIME)
    assert known(noise([slow], PERIOD, 15.0)) < 1e-5
    assert known(noise([slow + fast], PERIOD, 15.0)) == pytest.approx(0.03 / np.sqrt(2.0), rel=1e-3)
    white = 0.02 * RNG.standard_normal(len(TIME))
    assert known(noise([slow + white], PERIOD, 15.0)) == pytest.approx(0.02, rel=0.05)
    assert known(noise([slow, slow + fast], PERIOD, 15.0)) == pytest.approx(0.03 / 2.0, rel=1e-3)


def test_there_is_no_noise_figure_where_the_sampling_is_too_slow_or_too_short() -> None:
    assert noise([swing(TIME)], 0.05, 15.0) is None
    assert noise([swing(TIME)[:10]], PERIOD, 15.0) is None
    assert noise([], PERIOD, 15.0) is None


def test_variation_is_the_way_that_a_signal_goes_in_a_second() -> None:
    sine = 3.0 * np.sin(2.0 * np.pi * TIME)
    assert known(variation(TIME, sine)) == pytest.approx(12.0, rel=1e-3)
    assert variation(TIME, np.full(len(TIME), 4.0)) == 0.0
    assert variation(TIME[:1], sine[:1]) is None
    assert variation(TIME, np.full(len(TIME), np.nan)) is None


def test_columns_are_cut_at_breaks_and_at_rows_that_do_not_count() -> None:
    used, begins = np.ones(len(TIME), bool), np.zeros(len(TIME), bool)
    begins[[0, 5000]] = True
    used[:1000] = used[2000:2010] = False
    pieces = even_pieces(TIME, (TIME, 2.0 * TIME), used, begins, PERIOD)
    assert [(piece[0][0], piece[0][-1]) for piece in pieces] == [
        (TIME[1000], TIME[1999]),
        (TIME[2010], TIME[4999]),
        (TIME[5000], TIME[-1]),
    ]
    assert all(np.array_equal(second, 2.0 * first) for first, second in pieces)
    assert even_pieces(TIME, (TIME,), np.zeros(len(TIME), bool), begins, PERIOD) == []


def test_lost_samples_are_bridged_evenly() -> None:
    kept = np.sort(RNG.choice(len(TIME), len(TIME) * 4 // 5, replace=False))
    time, everything = TIME[kept], np.ones(len(kept), bool)
    begins = np.arange(len(kept)) == 0
    ((signal, true),) = even_pieces(time, (swing(time - 3e-3), swing(time)), everything, begins, PERIOD)
    assert len(signal) == round((time[-1] - time[0]) / PERIOD) + 1
    assert known(lag([(signal, true)], PERIOD, 15.0)) == pytest.approx(3e-3, abs=2e-5)
