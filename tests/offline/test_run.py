"""The observer over recordings whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline import ReplayResult, ReplaySettings, replay
from dcmp_hil.values import Estimate, Sample
from tests.offline.synthetic import INERTIA_KG_M2, MODEL, Truth, lose, swing


def true_error(truth: Truth, result: ReplayResult) -> float:
    """RMS error of the estimated velocity against the true one, rad/s."""
    error = (result.estimates.velocity - truth.velocity)[result.judged]
    return float(np.sqrt(np.mean(np.square(error))))


@pytest.mark.parametrize(("jitter", "share"), [(0, 0.0), (6, 0.0), (0, 0.05), (6, 0.05), (0, 0.3)])
def test_velocity_is_close_when_sampling_is_uneven_or_lossy(jitter: int, share: float) -> None:
    truth, _ = lose(swing(jitter=jitter), share)
    result = replay(truth.recording())
    assert true_error(truth, result) < 0.045  # rad/s; 0.040 with even sampling, an LSB a period is 0.97
    assert result.figures.velocity_error_rms_rad_s < 0.05
    assert result.figures.disturbance_sin_correlation == pytest.approx(0.987, abs=0.003)


def test_velocity_is_several_times_worse_when_dt_is_ignored() -> None:
    truth, _ = lose(swing(), 0.05)
    even = np.linspace(0.0, 0.003 * (len(truth.time) - 1), len(truth.time))
    pretended = Truth(even, truth.position, truth.voltage, truth.velocity)
    assert true_error(pretended, replay(pretended.recording())) > 3.0 * true_error(
        truth, replay(truth.recording())
    )


@pytest.mark.parametrize("jitter", [0, 6])
def test_lost_samples_are_counted_exactly_when_rows_are_missing(jitter: int) -> None:
    truth, lost = lose(swing(jitter=jitter), 0.05)
    assert lost > 50
    assert replay(truth.recording()).figures.lost_samples == lost


def test_late_sample_is_not_lost_when_the_next_step_is_short() -> None:
    truth = swing()
    late = truth.time.copy()
    late[500] += 0.0018  # s: steps of 1.6 and 0.4 periods
    assert replay(truth.recording(time=late)).figures.lost_samples == 0


def test_observer_restarts_and_settling_is_not_judged_when_a_gap_is_long() -> None:
    truth = swing()
    kept = np.ones(len(truth.time), dtype=bool)
    kept[1000:1012] = False  # a gap of 13 periods
    holed = truth.keep(kept)
    result = replay(holed.recording())
    assert result.figures.restarts == 1
    assert result.figures.lost_samples == 12
    assert result.estimates.velocity[1000] == 0.0
    assert result.estimates.position[1000] == holed.position[1000]
    after = holed.time - holed.time[1000]
    assert not result.judged[(after >= 0.0) & (after <= 0.3)].any()
    assert result.judged[(after > 0.301) & (after < 2.0)].all()
    assert true_error(holed, result) < 0.045


def test_observer_continues_when_a_gap_is_of_ten_periods() -> None:
    truth = swing()
    kept = np.ones(len(truth.time), dtype=bool)
    kept[1000:1009] = False
    result = replay(truth.keep(kept).recording())
    assert result.figures.restarts == 0
    assert result.estimates.velocity[1000] != 0.0


def test_input_of_row_before_is_applied_when_input_is_at_start() -> None:
    truth = swing(counts=None, kicks=3.0)
    ideal = ReplaySettings(counts_per_rev="ideal")
    start = replay(truth.recording(), ideal)
    assert start.applied[1:] == pytest.approx(truth.voltage[:-1])
    assert true_error(truth, start) < 2e-3
    assert start.figures.disturbance_error_rms_rad_s2 < 0.6  # the kicks are 16 rad/s2
    wrong = replay(truth.recording(), ReplaySettings(counts_per_rev="ideal", input_at="end"))
    assert true_error(truth, wrong) > 20.0 * true_error(truth, start)


def test_start_and_end_agree_when_the_column_is_shifted() -> None:
    truth = swing()
    shifted = np.concatenate((truth.voltage[:1], truth.voltage[:-1]))
    start = replay(truth.recording())
    end = replay(truth.recording(input=shifted), ReplaySettings(input_at="end"))
    assert end.figures == start.figures


def test_torque_acts_as_torque_over_inertia() -> None:
    truth = swing()
    torque = truth.recording(input=INERTIA_KG_M2 * MODEL.ku * truth.voltage, input_kind="torque")
    expected = replay(truth.recording()).estimates
    estimates = replay(torque, ReplaySettings(inertia=INERTIA_KG_M2)).estimates
    assert estimates.disturbance == pytest.approx(expected.disturbance, abs=1e-8)
    heavier = replay(torque, ReplaySettings(inertia=2.0 * INERTIA_KG_M2)).estimates
    assert np.max(np.abs(heavier.disturbance - expected.disturbance)) > 1.0


def test_missing_inertia_is_named_when_the_input_is_a_torque() -> None:
    with pytest.raises(ConfigError, match=r"--inertia"):
        replay(swing(duration=1.0).recording(input_kind="torque"))


def test_rule_of_mu0_takes_median_period_and_estimated_counts() -> None:
    truth, _ = lose(swing(), 0.05)
    figures = replay(truth.recording()).figures
    assert figures.period_s == pytest.approx(0.003)
    assert figures.counts_per_rev == pytest.approx(2156.0, rel=1e-6)
    assert figures.mu0_rad_s == pytest.approx(40.0 * (2156 / 4096) ** (1 / 3) * (1 / 3) ** (1 / 6), rel=1e-6)


def test_settings_reach_the_observer() -> None:
    truth = swing(duration=1.0)
    changes = {"f0": 0.7, "L1": 6.0, "L2": 8.0, "M": 90.0, "mu0": 55.0, "ku": 4.0, "counts_per_rev": 4096.0}
    result = replay(truth.recording(), ReplaySettings(**changes))  # type: ignore[arg-type]
    observer = SuperTwisting(
        ObserverContext(MODEL._replace(f0=0.7, ku=4.0), result.figures.period_s, 4096.0),
        L1=6.0,
        L2=8.0,
        M=90.0,
        mu0=55.0,
    )
    rows = zip(truth.time.tolist(), truth.position.tolist(), result.applied.tolist(), strict=True)
    expected = [observer.update(Sample(*row)) for row in rows]
    assert np.column_stack(result.estimates).tolist() == [list(estimate) for estimate in expected]
    assert result.figures.mu0_rad_s == 55.0


def test_paper_observer_runs_when_chosen() -> None:
    truth = swing()
    figures = replay(truth.recording(), ReplaySettings(observer="paper")).figures
    assert figures.mu0_rad_s is None
    assert 0.05 < figures.velocity_error_rms_rad_s < 0.2  # M = 1000 is loud with 2156 counts


class Still:
    """An observer of one's own, that believes in no motion."""

    def __init__(self, setting: ObserverContext) -> None:
        self.setting = setting

    def update(self, sample: Sample) -> Estimate:
        return Estimate(sample.position, 0.0, 0.0)


class Runaway(Still):
    """An observer whose estimate diverges."""

    def update(self, sample: Sample) -> Estimate:
        return Estimate(0.0, float("inf") if sample.t > 0.5 else 0.0, 0.0)


def test_own_observer_runs_when_named() -> None:
    truth = swing()
    figures = replay(truth.recording(), ReplaySettings(observer=f"{__name__}:Still")).figures
    expected = np.sqrt(np.mean(truth.velocity[truth.time > 0.3] ** 2))
    assert figures.velocity_error_rms_rad_s == pytest.approx(expected, rel=0.01)
    assert figures.disturbance_sin_correlation is None


def test_runaway_is_named_with_its_row() -> None:
    with pytest.raises(ConfigError, match=r"runs away at row 168\b"):
        replay(swing().recording(), ReplaySettings(observer=f"{__name__}:Runaway"))


def test_given_velocity_is_judged_like_the_estimate() -> None:
    truth = swing()
    figures = replay(truth.recording(velocity=truth.velocity + 0.5)).figures
    assert figures.given_velocity_error_rms_rad_s == pytest.approx(0.5, abs=0.01)
    assert replay(truth.recording()).figures.given_velocity_error_rms_rad_s is None


def test_same_figures_when_time_starts_elsewhere() -> None:
    truth = swing()
    base, moved = replay(truth.recording()), replay(truth.recording(time=truth.time + 1.75e9))
    assert moved.figures.velocity_error_rms_rad_s == pytest.approx(
        base.figures.velocity_error_rms_rad_s, rel=1e-3
    )
    assert moved.figures.window_s == pytest.approx(base.figures.window_s, abs=1e-5)


def test_nothing_to_judge_is_named_when_the_recording_is_short() -> None:
    with pytest.raises(ConfigError, match=r"--from"):
        replay(swing(duration=0.25).recording())


def test_slow_sampling_is_named_with_the_time_unit() -> None:
    truth = swing()
    with pytest.raises(ConfigError, match=r"--time-unit"):
        replay(truth.recording(time=1000.0 * truth.time))


def test_impossibly_fast_sampling_is_named_with_the_time_unit() -> None:
    truth = swing()
    with pytest.raises(ConfigError, match=r"--time-unit"):
        replay(truth.recording(time=1e-6 * truth.time))


def test_every_setting_out_of_range_is_named_at_once() -> None:
    with pytest.raises(ConfigError) as caught:
        ReplaySettings(inertia=0.0, L1=-1.0, f0=float("nan"), mu0=float("inf"), input_at="middle")  # type: ignore[arg-type]
    for option in ("--inertia", "--L1", "--f0", "--mu0", "--input-at"):
        assert option in str(caught.value)


def test_unknown_observer_is_named_with_a_guess() -> None:
    with pytest.raises(ConfigError, match=r'Did you mean "super_twisting"'):
        replay(swing(duration=1.0).recording(), ReplaySettings(observer="supertwisting"))


def test_missing_scipy_is_named_with_the_pip_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "scipy.signal", None)
    with pytest.raises(ConfigError, match=r"pip install scipy"):
        replay(swing(duration=1.0).recording())


def test_a_motion_that_no_arm_makes_is_an_error() -> None:
    truth = swing()
    with pytest.raises(ConfigError, match=r"rad/s .*--position-unit.*--modulus"):
        replay(truth.recording(position=1000.0 * truth.position))


def test_an_error_that_no_observer_makes_is_one() -> None:
    truth = swing()
    with pytest.raises(ConfigError, match=r"is no figure of an observer.*--ku"):
        replay(truth.recording(), ReplaySettings(ku=5400.0))


def test_an_observer_begins_anew_at_a_break() -> None:
    truth = swing()
    shifted = truth.position + np.where(np.arange(len(truth.time)) >= 1000, 5.0, 0.0)
    result = replay(truth.recording(position=shifted, breaks=(1000,)))
    assert (result.figures.restarts, result.figures.lost_samples) == (1, 0)
    assert result.estimates.velocity[1000] == 0.0
    assert result.estimates.position[1000] == shifted[1000]
    after = truth.time - truth.time[1000]
    assert not result.judged[(after >= 0.0) & (after <= 0.3)].any()
    assert true_error(truth, result) < 0.045
