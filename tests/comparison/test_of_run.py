"""Observers side by side over a run: what judges them, and what is there of a run that was not kept."""

from __future__ import annotations

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.comparison import ObserverBeside, compare_in_run, compare_result
from dcmp_hil.errors import ConfigError
from dcmp_hil.session import Session
from tests.helpers import STEADY, bench, known

KINDS = ("kalman", "derivative")


def test_the_table_is_made_from_the_result_of_a_run() -> None:
    result = run(bench(*STEADY), duration=3.0, fast=True, window_from=1.0, compare="kalman,derivative")
    found = compare_result(result)
    assert found is not None
    assert [one.observer for one in found.observers] == ["super_twisting", *KINDS]
    assert found.window_s is not None
    assert list(found.window_s) == pytest.approx([1.0, 2.999])
    loop = found.observers[0]
    assert loop.velocity_error_rms_rad_s == pytest.approx(known(result.summary.velocity_error_rms_rad_s))
    assert loop.disturbance_error_rms_rad_s2 == pytest.approx(
        known(result.summary.disturbance_error_rms_rad_s2)
    )
    assert loop.voltage_tv_V_s == pytest.approx(known(result.summary.voltage_tv_V_s), rel=2e-3)
    again = compare_result(run(bench(*STEADY), duration=3.0, fast=True, window_from=1.0, compare=KINDS))
    assert again is not None
    for one, other in zip(found.observers, again.observers, strict=True):
        assert one.velocity_lag_s == other.velocity_lag_s  # virtual time repeats to the bit
        assert one.disturbance_noise_rad_s2 == other.disturbance_noise_rad_s2


def test_without_columns_the_last_cycles_are_compared() -> None:
    session = Session(bench(*STEADY), duration=5.0, fast=True, keep_columns=False, compare=["kalman"])
    session.run()
    result = session.result()
    assert result.columns == {}
    found = compare_result(result)
    assert found is not None
    assert found.window_s is not None
    assert 0.0 < found.window_s[0] < found.window_s[1] == pytest.approx(4.999)
    assert known(found.observers[1].velocity_error_rms_rad_s) > 0.0


def test_a_run_that_was_not_asked_compares_nothing() -> None:
    session = Session(bench(), duration=0.1, fast=True, keep_columns=False)
    session.run()
    result = session.result()
    assert result.last_columns == {}
    assert compare_result(result) is None


def test_where_the_truth_is_not_known_the_zero_phase_reference_judges(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = bench(*STEADY)
    result = run(rig, duration=6.0, fast=True, compare=["derivative"])
    true = result.columns["velocity_true_rad_s"]
    columns = {
        name: np.full_like(values, np.nan) if "_true_" in name else values
        for name, values in result.columns.items()
    }
    beside = {
        "derivative": ObserverBeside(
            columns["velocity_derivative_rad_s"],
            columns["disturbance_derivative_rad_s2"],
            None,
            bench("observer.kind=derivative").observer,
        ),
        "true": ObserverBeside(true, result.columns["disturbance_true_rad_s2"], None, rig.observer),
    }
    beside["true"].disturbance[0] = 0.0
    found = compare_in_run(rig, columns, beside, window_from=1.0)
    assert found.reference == "zero_phase"
    _, derivative, perfect = found.observers
    assert known(derivative.velocity_lag_s) == pytest.approx(1.0 / 60.0, abs=3e-3)
    assert derivative.voltage_tv_V_s is None
    assert known(perfect.velocity_error_rms_rad_s) < 0.02
    assert known(perfect.velocity_lag_s) == pytest.approx(0.0, abs=1e-3)

    def missing(*_: object, **__: object) -> None:
        raise ConfigError("It needs scipy.")

    monkeypatch.setattr("dcmp_hil.comparison.of_run.zero_phase", missing)
    without = compare_in_run(rig, columns, beside, window_from=1.0)
    assert (without.reference, without.notes) == ("none", ("It needs scipy.",))
    assert without.observers[0].velocity_error_rms_rad_s is None
