"""Telemetry in a process of its own: what comes back, and what its death costs."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import ConfigError, run
from dcmp_hil.session import Session
from dcmp_hil.telemetry import telemetry_process as module
from dcmp_hil.telemetry.statistics import Statistics
from dcmp_hil.telemetry.telemetry_process import TelemetryProcess
from dcmp_hil.values import Event, EventKind
from tests.helpers import bench
from tests.telemetry.sinks import Notes, Refuses, Sleeps, Strikes, T, fill, noted, strike_all

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.recorder import Sink

pytestmark = pytest.mark.usefixtures("nothing_left")


def test_a_run_gives_the_same_figures_and_columns_from_there() -> None:
    here = run(bench(), duration=1.5, fast=True)
    there = run(bench(), duration=1.5)
    assert there.dropped == 0
    assert list(there.columns) == list(here.columns)
    timing = {"period_us", "lateness_us", "compute_us"}
    for name in set(here.columns) - timing:  # virtual time and the wall's differ in nothing else
        np.testing.assert_array_equal(there.columns[name], here.columns[name], err_msg=name)
    for figure in (
        "tracking_rms_rad",
        "tracking_max_rad",
        "velocity_error_rms_rad_s",
        "voltage_peak_V",
        "periods",
    ):
        assert getattr(there.summary, figure) == pytest.approx(getattr(here.summary, figure), rel=1e-12)
    assert there.summary.lateness_us.max == pytest.approx(there.columns["lateness_us"].max(), abs=1e-3)
    texts = [event.text for event in there.events if event.kind is EventKind.PHASE]
    assert texts == [event.text for event in here.events if event.kind is EventKind.PHASE]


def test_a_sink_that_is_made_there_sees_every_row_and_event(tmp_path: Path) -> None:
    file = tmp_path / "notes"
    result = run(bench(), duration=0.5, sinks=[partial(Notes, file, ("no viewer",))])
    assert noted(file, "pid") != [str(os.getpid())]
    assert sum(map(int, noted(file, "rows"))) == 500
    assert noted(file, "event")[-1] == "amplifier at 0 V"
    assert noted(file, "closed") == [""]
    assert "no viewer" in [event.text for event in result.events]
    assert result.troubles == ("0.000 s: no viewer",)


def test_sinks_that_cannot_go_there_run_here(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    result = run(bench(), duration=0.3, sinks=[Notes(one), lambda: Notes(other, ("half a viewer",))])
    for file in (one, other):
        assert noted(file, "pid") == [str(os.getpid())]
        assert sum(map(int, noted(file, "rows"))) == 300
        assert noted(file, "closed") == [""]
    assert result.troubles == ("0.000 s: half a viewer",)


def test_memory_stays_bounded_where_no_columns_are_kept() -> None:
    session = Session(bench(), duration=0.3, keep_columns=False)
    session.run()
    result = session.result()
    assert (result.columns, result.events, result.summary.periods) == ({}, (), 300)


def test_a_sink_that_refuses_ends_the_run_before_it_begins() -> None:
    with pytest.raises(ConfigError, match="no such folder"):
        run(bench(), duration=10.0, sinks=[partial(Refuses, ConfigError("no such folder"))])


def test_a_sink_that_cannot_be_made_is_told_of_and_the_run_goes_on(tmp_path: Path) -> None:
    makers: list[Callable[[], Sink]] = [
        partial(Refuses, ValueError("no such channel")),
        partial(Notes, tmp_path / "notes"),
    ]
    result = run(bench(), duration=0.2, sinks=makers)
    assert result.summary.periods == 200
    assert "ValueError: no such channel" in result.troubles[0]
    assert "no such channel" in noted(tmp_path / "notes", "event")[0]


# ---------------------------------------------------------------- when it fails


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_run_ends_with_all_its_figures_when_the_process_does_not(number: signal.Signals) -> None:
    told: list[str] = []
    strike = Strikes(0.5, lambda: strike_all(number))
    session = Session(bench(), duration=1.5, sinks=[strike], warn=told.append)
    session.run()
    result = session.result()
    assert strike.struck
    assert result.summary.periods == len(result.columns["time_s"]) == 1500
    assert result.columns["time_s"] == pytest.approx(T * np.arange(1500))
    assert result.dropped == 0
    assert result.events[-1].level == "WARN"
    assert [event.text for event in result.events].count("amplifier at 0 V") == 1
    (sentence,) = told
    assert sentence in result.troubles[-1]
    assert ("SIGKILL" if number == signal.SIGKILL else "did not answer") in sentence
    assert "the figures are complete" in sentence


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_end_takes_two_seconds_at_most_in_any_state_of_the_process(number: signal.Signals) -> None:
    apart = TelemetryProcess(Statistics(T), keep=True)
    apart.open()
    fill(apart, 100)
    assert apart.pid is not None
    os.kill(apart.pid, number)
    os.waitid(os.P_PID, apart.pid, os.WEXITED | os.WSTOPPED | os.WNOWAIT)  # until then it may still work
    began = time.monotonic()
    apart.close()
    assert time.monotonic() - began < module._END_TIMEOUT_S + 0.5  # noqa: SLF001 - and what the scheduler needs
    assert len(apart.figures.columns()["time_s"]) == 100


def test_what_was_overwritten_meanwhile_is_counted_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_CAPACITY_ROWS", 256)
    told: list[str] = []
    apart = TelemetryProcess(Statistics(T), keep=True, warn=told.append)
    apart.open()
    assert apart.pid is not None
    os.kill(apart.pid, signal.SIGSTOP)
    fill(apart, 1000)
    apart.close()
    t = apart.figures.columns()["time_s"]
    assert apart.dropped == 1000 - len(t)
    assert t == pytest.approx(T * np.arange(1000 - len(t), 1000))
    assert len(t) <= 256
    assert f"{apart.dropped} periods are in no figure" in told[0]


def test_events_never_block_and_come_back_although_they_are_not_read() -> None:
    apart = TelemetryProcess(Statistics(T), keep=True)
    apart.open()
    assert apart.pid is not None
    os.kill(apart.pid, signal.SIGSTOP)
    longest = 0.0
    for k in range(3000):  # more than a socket holds
        began = time.monotonic()
        apart.event(Event(k * T, "INFO", EventKind.OTHER, f"event {k} " + "x" * 200))
        longest = max(longest, time.monotonic() - began)
    apart.close()
    assert longest < 1.0
    texts = [event.text.split(" x")[0] for event in apart.figures.events()]
    assert texts[:3000] == [f"event {k}" for k in range(3000)]


def test_a_process_that_does_not_come_up_is_told_of_and_the_run_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_START_TIMEOUT_S", 0.5)
    told: list[str] = []
    session = Session(bench(), duration=0.3, sinks=[partial(Sleeps, 60.0)], warn=told.append)
    session.run()
    result = session.result()
    assert result.summary.periods == 300  # worked out from the ring, at the end
    assert "did not come up" in told[0]
    assert "did not come up" in result.troubles[0]


class Leaves(Notes):
    """A sink that ends its process."""

    def __init__(self) -> None:
        os._exit(7)


class Busy(Notes):
    """A sink that holds the interpreter lock of its process for longer than an idle one is waited for."""

    def __init__(self) -> None:
        """Accept no notes."""

    def block(self, block: Block) -> None:  # noqa: ARG002
        """Make every other thread wait, as on a slow computer: C code keeps the interpreter lock."""
        sum(range(150_000_000))

    def close(self) -> None:
        """Do nothing."""


def test_a_process_that_ends_at_once_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_START_TIMEOUT_S", 1e6)  # never
    result = run(bench(), duration=0.2, sinks=[partial(Leaves)])
    assert result.summary.periods == 200
    assert "did not come up" in result.troubles[0]


def test_a_stop_ends_the_wait_for_a_process_that_is_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_START_TIMEOUT_S", 1e6)
    monkeypatch.setattr(module, "_SLOW_START_S", 0.3)
    told: list[str] = []
    apart = TelemetryProcess(
        Statistics(T), keep=False, sinks=[pickle.dumps(partial(Sleeps, 1e6))], warn=told.append
    )
    apart.open(lambda: bool(told))
    assert apart.pid is None
    apart.close()
    assert told == ["The telemetry process is still starting after 0.3 s; Ctrl-C ends this."]


def test_a_process_that_works_at_its_figures_is_waited_for() -> None:
    told: list[str] = []
    apart = TelemetryProcess(Statistics(T), keep=True, sinks=[pickle.dumps(partial(Busy))], warn=told.append)
    apart.open()
    fill(apart, 100)
    pid = apart.pid
    assert pid is not None
    apart.close()
    with suppress(ChildProcessError):  # it has ended and was waited for, or its sink is still at work
        os.waitpid(pid, 0)
    assert len(apart.figures.columns()["time_s"]) == 100
    assert not told


def test_a_python_that_is_not_there_is_told_of_and_the_run_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", "/no/such/python")
    result = run(bench(), duration=0.2)
    assert result.summary.periods == 200
    assert "could not be started" in result.troubles[0]
