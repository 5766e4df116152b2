"""Further columns of a run: from their source through ring and sinks, here and in the telemetry process."""

from __future__ import annotations

import csv
import io
import pickle
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.cli.black_box import black_box
from dcmp_hil.errors import TripError
from dcmp_hil.ipc.ring import FIELDS, Ring, capacity_of, size_of
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.recording.reader import read_run
from dcmp_hil.recording.writer import RecordingSink
from dcmp_hil.telemetry.block import ReferenceAligner
from dcmp_hil.telemetry.further_columns import (
    CHANNEL_NAMES,
    FURTHER_MAX,
    NO_FURTHER_COLUMNS,
    fault_of,
    joined,
)
from dcmp_hil.telemetry.memory_sink import MemorySink
from dcmp_hil.telemetry.recorder import Recorder
from dcmp_hil.telemetry.signals import names
from dcmp_hil.telemetry.statistics import Statistics
from dcmp_hil.telemetry.telemetry_process import TelemetryProcess
from dcmp_hil.values import UNKNOWN_TRUTH, Event, EventKind, Reference, Truth
from tests.helpers import bench, cycle

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from dcmp_hil.values import Cycle

NAMES = ("half_time_s", "voltage_half_time_V")
_T = 1e-3  # s


class Halves:
    """Half of the time, twice, and an event at the second cycle."""

    names = NAMES

    def __init__(self) -> None:
        self._cycles = 0
        self._events: list[Event] = []

    def values(self, cycle: Cycle) -> tuple[float, ...]:
        self._cycles += 1
        if self._cycles == 2:
            self._events.append(Event(cycle.sample.t, "WARN", EventKind.TELEMETRY, "the second"))
        return 0.5 * cycle.sample.t, -0.5 * cycle.sample.t

    def events(self) -> Sequence[Event]:
        told, self._events = self._events, []
        return told


class _Ones:
    names = ("one",)

    def values(self, _: Cycle) -> tuple[float, ...]:
        return (1.0,)

    def events(self) -> Sequence[Event]:
        return ()


def _recorder(sink: MemorySink, *, in_line: bool = True, recent: int = 100) -> Recorder:
    aligner = ReferenceAligner(lambda _: Reference(0.0, 0.0, 0.0), 0.0)
    return Recorder(lambda: UNKNOWN_TRUTH, aligner, [sink], recent=recent, in_line=in_line, further=Halves())


# ------------------------------------------------------------------------------------------------ ring


def test_a_ring_holds_further_fields_behind_the_known_ones() -> None:
    ring = Ring(4, further=NAMES)
    for k in range(6):
        ring.push(cycle(float(k)), Truth(7.0, 8.0, 9.0), further=(k + 0.25, k + 0.5))
    assert ring.latest()["voltage_half_time_V"] == 5.5
    rows = ring.reader().drain()
    assert rows.shape == (4, len(FIELDS) + 2)
    assert rows[:, len(FIELDS) :].tolist() == [[k + 0.25, k + 0.5] for k in range(2, 6)]
    assert rows[:, 0].tolist() == [2, 3, 4, 5]


def test_size_and_capacity_of_a_ring_count_further_fields() -> None:
    assert size_of(100, 3) - size_of(100) == 100 * 3 * 8
    assert [capacity_of(size_of(100, further), further) for further in (0, 1, 64)] == [100] * 3


# ------------------------------------------------------------------------------------------------ recorder


@pytest.mark.parametrize("in_line", [True, False])
def test_every_cycle_reaches_the_sinks_with_its_further_columns(in_line: bool) -> None:
    sink = MemorySink()
    recorder = _recorder(sink, in_line=in_line)
    for k in range(1000):
        recorder.record(cycle(k * _T))
    recorder.tell_rest()
    recorder.close()
    columns = sink.columns()
    assert tuple(columns) == names(NAMES)
    np.testing.assert_array_equal(columns["half_time_s"], 0.5 * columns["time_s"])
    np.testing.assert_array_equal(columns["voltage_half_time_V"], -0.5 * columns["time_s"])
    assert [(event.t, event.text) for event in sink.events] == [(_T, "the second")]


def test_a_trip_has_the_further_columns_of_its_last_second() -> None:
    recorder = _recorder(MemorySink(), recent=10)
    for k in range(25):
        recorder.record(cycle(k * _T))
    trip = TripError("disturbance", "It was too large.", "Look.")
    recorder.fill(trip)
    rows = list(csv.DictReader(io.StringIO(black_box(trip))))
    assert len(rows) == 10
    assert [float(row["half_time_s"]) for row in rows] == [0.5 * float(row["t_s"]) for row in rows]


def test_sources_are_joined_in_order_and_none_costs_nothing() -> None:
    assert joined(()) is NO_FURTHER_COLUMNS
    assert joined([NO_FURTHER_COLUMNS]) is NO_FURTHER_COLUMNS
    halves = Halves()
    assert joined([NO_FURTHER_COLUMNS, halves]) is halves
    both = joined([halves, _Ones()])
    assert both.names == (*NAMES, "one")
    assert both.values(cycle(4.0)) == (2.0, -2.0, 1.0)
    both.values(cycle(5.0))
    assert [event.t for event in both.events()] == [5.0]


@pytest.mark.parametrize(
    "wrong",
    [
        ("position",),
        ("position_rad",),
        ("gravity_rad_s2",),
        ("voltage_sent_V",),
        ("lateness_s",),
        ("time_s",),
        ("a_rad", "a_rad"),
        ("Friction_rad",),
        ("friction__rad",),
        ("friction_",),
        ("",),
        ("voltage_v",),
        ("x\nfloat64 y",),
        ("é_rad",),
        ("x" * 81,),
        tuple(f"column{k}" for k in range(FURTHER_MAX + 1)),
    ],
)
def test_names_that_others_have_or_ros_does_not_take_are_refused(wrong: tuple[str, ...]) -> None:
    assert fault_of(wrong)


def test_names_with_units_are_taken() -> None:
    assert not fault_of(NAMES)
    assert not fault_of(("friction_found_rad_s2", "voltage_demand_kalman_V", "stuck"))
    assert not fault_of(tuple(f"column{k}" for k in range(FURTHER_MAX)))
    assert not any(name.endswith("_V") for name in CHANNEL_NAMES)


# ------------------------------------------------------------------------------------------------ process


def _recording(path: Path) -> RecordingSink:
    rig = bench()
    return RecordingSink(path, rig.period, about(rig), rig_json(rig))


def test_telemetry_process_keeps_and_records_further_columns(tmp_path: Path) -> None:
    sinks = [pickle.dumps(partial(_recording, tmp_path / "run.mcap"))]
    apart = TelemetryProcess(Statistics(_T), keep=True, sinks=sinks, further=NAMES)
    apart.open()
    apart.event(Event(0.0, "INFO", EventKind.OTHER, "before the first period"))
    for k in range(500):
        apart.ring.push(cycle(k * _T), UNKNOWN_TRUTH, further=(0.5 * k * _T, 0.25))
    apart.close()
    columns = apart.figures.columns()
    assert tuple(columns) == names(NAMES)
    np.testing.assert_array_equal(columns["half_time_s"], 0.5 * columns["time_s"])
    read = read_run(tmp_path)
    assert read.complete
    assert read.further == NAMES
    np.testing.assert_array_equal(read.columns["half_time_s"], columns["half_time_s"])
    assert [event.text for event in read.events] == ["before the first period"]


def test_figures_go_on_with_further_columns_where_the_process_did_not_come_up() -> None:
    apart = TelemetryProcess(Statistics(_T), keep=True, further=NAMES)  # never opened
    for k in range(100):
        apart.ring.push(cycle(k * _T), UNKNOWN_TRUTH, further=(0.5 * k * _T, 0.25))
    apart.close()
    assert apart.figures.columns()["voltage_half_time_V"].tolist() == [0.25] * 100
