"""The diagnosis of an observer in telemetry: of the built-in ones, of a user's own, and one that fails."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.assembly import make_observer
from dcmp_hil.config.rig import KINDS
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.reexecute import reexecute
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.telemetry.diagnosis_columns import diagnosis_of
from dcmp_hil.telemetry.further_columns import NO_FURTHER_COLUMNS
from tests.helpers import STEADY, bench, cycle, named

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.values import Estimate, Sample

_FRICTION = (*STEADY, "observer.kind=friction_kalman")


class Fails:
    """A user's observer whose diagnosis fails in the hundredth cycle."""

    DIAGNOSIS: ClassVar[tuple[str, ...]] = ("samples_seen",)

    def __init__(self, context: ObserverContext) -> None:
        self._inner = SuperTwisting(context)
        self._samples = 0

    def update(self, sample: Sample) -> Estimate:
        self._samples += 1
        return self._inner.update(sample)

    def diagnose(self) -> tuple[float, ...]:
        if self._samples == 100:
            raise ZeroDivisionError("a mean of nothing")
        return (np.float64(self._samples),)  # as numpy has them


class _Diagnosed:
    DIAGNOSIS: Any = ("a_rad", "b_rad")

    def __init__(self, found: Any) -> None:
        self._found = found

    def diagnose(self) -> Any:
        if isinstance(self._found, BaseException):
            raise self._found
        return self._found


def test_every_built_in_diagnosis_gives_a_number_for_each_of_its_names() -> None:
    diagnosed = []
    for kind in set(KINDS["observer"]) - {"custom"}:
        rig = bench(f"observer.kind={kind}")
        found = diagnosis_of(make_observer(rig), kind)
        if found.names:
            diagnosed.append(kind)
            assert len(found.values(cycle(0.0))) == len(found.names)
            assert found.events() == []
    assert diagnosed == ["friction_kalman"]


def test_a_run_has_the_inside_of_friction_kalman_in_its_columns(tmp_path: Path) -> None:
    rig = bench(*_FRICTION)
    sink = RecordingSink(tmp_path / "run.mcap", rig.period, about(rig), rig_json(rig))
    columns = run(rig, duration=6.0, fast=True, sinks=[sink]).columns
    assert columns["friction_found_rad_s2"][0] == 1.3
    assert columns["friction_found_rad_s2"][-1] == pytest.approx(1.3, abs=0.1)
    assert columns["friction_deviation_rad_s2"][-1] < columns["friction_deviation_rad_s2"][0] == 0.25
    assert set(columns["stuck"]) <= {0.0, 1.0}
    assert (columns["distrust"] >= 1.0).all()
    assert (np.diff(columns["disturbance_steps"]) >= 0.0).all()
    read = read_run(tmp_path)
    assert read.complete
    assert {name: column.tobytes() for name, column in read.columns.items()} == {
        name: column.tobytes() for name, column in columns.items()
    }
    again = reexecute(read)
    assert again.estimate.tobytes() == np.ascontiguousarray(read.rows[:, 4:7]).tobytes()
    assert again.demand.tobytes() == read.block["voltage_demand"].tobytes()


def test_a_diagnosis_that_fails_is_dropped_with_an_event_and_the_run_goes_on() -> None:
    result = run(bench(*STEADY, f"observer.kind={named(Fails)}"), duration=2.5, fast=True)
    assert result.summary.periods == 2500
    seen = result.columns["samples_seen"]
    assert seen[:99].tolist() == list(range(1, 100))
    assert np.isnan(seen[99:]).all()
    (told,) = [event for event in result.events if "diagnosis" in event.text]
    assert told.t == pytest.approx(0.099)
    assert told.level == "WARN"
    assert "ZeroDivisionError: a mean of nothing" in told.text
    assert "test_diagnosis_columns.py" in told.text


def test_a_diagnosis_that_fails_in_the_last_second_of_a_run_is_told() -> None:
    result = run(bench(*STEADY, f"observer.kind={named(Fails)}"), duration=0.2, fast=True)
    assert [event.t for event in result.events if "diagnosis" in event.text] == [pytest.approx(0.099)]


@pytest.mark.parametrize(
    "found",
    [(1.0,), (1.0, 2.0, 3.0), None, 7, (1.0, "2"), ("a", "b"), SystemExit(3), ValueError("no")],
)
def test_what_is_no_diagnosis_is_nan_from_there_on_and_told_once(found: Any) -> None:
    columns = diagnosis_of(_Diagnosed(found), "mine:Mine")
    for t in (1.0, 2.0):
        assert all(map(math.isnan, columns.values(cycle(t))))
    (told,) = columns.events()
    assert told.t == 1.0
    verb = "raised" if isinstance(found, BaseException) else "returned"
    assert told.text.startswith(f"The diagnosis of mine:Mine {verb} ")
    assert columns.events() == []


@pytest.mark.parametrize("found", [(1.0, math.nan), [1.0, math.inf], (np.float64(1.0), 2)])
def test_numbers_of_any_kind_are_taken(found: Any) -> None:
    columns = diagnosis_of(_Diagnosed(found), "mine:Mine")
    values = columns.values(cycle(1.0))
    assert [type(value) for value in values] == [float, float]
    assert values[0] == 1.0
    assert columns.events() == []


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("bias_rad", "a tuple of names"),
        ((1, 2), "a tuple of names"),
        (7, "a tuple of names"),
        (("position_rad",), "position_rad is there already"),
        (("bias_rad", "bias_rad"), "bias_rad is there already"),
        (("Bias",), "is no name"),
    ],
)
def test_names_that_are_none_are_refused_before_the_run(
    names: Any, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Fails, "DIAGNOSIS", names)
    with pytest.raises(ConfigError, match=said):
        run(bench(f"observer.kind={named(Fails)}"), duration=1.0, fast=True)


def test_a_diagnosis_without_its_method_is_refused() -> None:
    class Half:
        DIAGNOSIS = ("bias_rad",)

    with pytest.raises(ConfigError, match="no method diagnose"):
        diagnosis_of(Half(), "mine:Half")
    assert diagnosis_of(object(), "mine:Mine") is NO_FURTHER_COLUMNS
