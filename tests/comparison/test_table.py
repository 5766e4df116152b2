"""The table of observers: its figures are those of the columns, and what is not known is None."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from dcmp_hil.comparison import ComparedObserver, ComparedRows, ComparisonReference, compare_observers
from dcmp_hil.errors import ConfigError
from tests.comparison.test_signal_figures import PERIOD, TIME, swing
from tests.helpers import known

RNG = np.random.default_rng(8)
TRUE = ComparisonReference(kind="truth", velocity=swing(TIME), disturbance=3.0 * swing(TIME))
LATE = 5e-3
ROUGH = 0.01 * RNG.standard_normal(len(TIME))
LOOP = ComparedObserver(
    name="super_twisting",
    velocity=swing(TIME - LATE) + ROUGH,
    disturbance=TRUE.disturbance + 0.5,
    voltage=np.where(np.arange(len(TIME)) % 2, 0.1, 0.0),
    closes_loop=True,
)
BESIDE = ComparedObserver(name="kalman", velocity=TRUE.velocity, disturbance=TRUE.disturbance)
USED = TIME >= 1.0
ROWS = ComparedRows(TIME, USED, np.arange(len(TIME)) == 0, PERIOD)


def test_figures_are_those_of_the_columns() -> None:
    found = compare_observers(ROWS, [LOOP, BESIDE], TRUE, {"super_twisting": 2.0, "kalman": 5.0})
    assert (found.reference, found.cutoff_hz) == ("truth", 15.0)
    assert found.window_s == (1.0, TIME[-1])
    loop, beside = found.observers
    error = (LOOP.velocity - TRUE.velocity)[USED]
    assert (loop.observer, loop.closes_loop) == ("super_twisting", True)
    assert known(loop.velocity_error_rms_rad_s) == pytest.approx(float(np.sqrt(np.mean(error**2))))
    assert known(loop.disturbance_error_rms_rad_s2) == pytest.approx(0.5)
    assert known(loop.velocity_lag_s) == pytest.approx(LATE, abs=1e-3)
    assert known(loop.velocity_noise_rad_s) == pytest.approx(0.01, rel=0.05)
    assert known(loop.disturbance_noise_rad_s2) < 1e-3
    assert known(loop.voltage_tv_V_s) == pytest.approx(100.0)
    assert (loop.cost_us, loop.cost_ratio) == (2.0, 1.0)
    assert (beside.observer, beside.closes_loop) == ("kalman", False)
    assert (beside.velocity_error_rms_rad_s, beside.voltage_tv_V_s) == (0.0, None)
    assert known(beside.velocity_lag_s) == pytest.approx(0.0, abs=1e-6)
    assert (beside.cost_us, beside.cost_ratio) == (5.0, 2.5)
    assert found.notes == ()
    assert json.loads(json.dumps(found.to_dict()))["observers"][1]["cost_ratio"] == 2.5


def test_an_observer_that_gave_up_has_no_figures_and_a_note() -> None:
    velocity = np.where(TIME < 4.0, TRUE.velocity, np.nan)
    broken = replace(BESIDE, velocity=velocity, voltage=velocity)
    found = compare_observers(ROWS, [LOOP, broken], TRUE, {"super_twisting": 2.0, "kalman": 5.0})
    figures = found.observers[1]
    assert {value for name, value in vars(figures).items() if name not in {"observer", "closes_loop"}} == {
        None
    }
    assert known(found.observers[0].velocity_noise_rad_s) > 0.0
    assert found.notes == ("kalman has no numbers from 4.000 s on, and therefore no figures.",)


def test_a_slow_observer_beside_the_loop_is_named_with_what_it_does_to_the_loop() -> None:
    found = compare_observers(ROWS, [LOOP, BESIDE], TRUE, {"super_twisting": 400.0, "kalman": 320.0})
    assert found.notes == (
        "kalman takes 320 µs a step, of a period of 1000 µs: beside the loop of a run it makes cycles late.",
    )


def test_without_a_reference_there_are_noise_and_variation() -> None:
    nothing = np.full(len(TIME), np.nan)
    found = compare_observers(
        ROWS, [LOOP], ComparisonReference(kind="none", velocity=nothing, disturbance=nothing), {}
    )
    (loop,) = found.observers
    assert loop.velocity_error_rms_rad_s is None
    assert loop.disturbance_error_rms_rad_s2 is None
    assert loop.velocity_lag_s is None
    assert known(loop.velocity_noise_rad_s) == pytest.approx(0.01, rel=0.05)
    assert known(loop.voltage_tv_V_s) > 0.0


def test_without_scipy_there_is_no_noise_and_a_note_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(*_: object) -> None:
        raise ConfigError("It needs scipy. Install it: pip install scipy")

    monkeypatch.setattr("dcmp_hil.comparison.signal_figures.low_pass", missing)
    found = compare_observers(ROWS, [LOOP, BESIDE], TRUE, {})
    assert {one.velocity_noise_rad_s for one in found.observers} == {None}
    assert {one.velocity_lag_s for one in found.observers} == {None}
    assert known(found.observers[0].velocity_error_rms_rad_s) > 0.0
    assert found.notes == ("No figures of lag and noise: It needs scipy. Install it: pip install scipy",)


def test_rows_that_do_not_count_leave_nothing() -> None:
    rows = ROWS._replace(used=np.zeros(len(TIME), bool))
    found = compare_observers(rows, [LOOP], TRUE, {})
    assert found.window_s is None
    assert found.observers[0].velocity_error_rms_rad_s is None
