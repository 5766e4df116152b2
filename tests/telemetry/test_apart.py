"""Telemetry in a process of its own: what comes back, and what its death, or ours, costs."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import ConfigError, load_rig, run
from dcmp_hil.session import Session
from dcmp_hil.telemetry import apart as module
from dcmp_hil.telemetry.apart import Apart
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.statistics import Statistics
from dcmp_hil.values import UNKNOWN_TRUTH, Event, EventKind, Reference
from tests.helpers import bench, cycle
from tests.telemetry.runs import VIEW, values

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.recorder import Sink

_T = 1e-3  # s
_BOUND = 60.0  # s: generous, these machines are shared
_HELD = Reference(0.0, 0.0, 0.0)


class Notes:
    """A sink that writes what it sees into a file, from any process."""

    def __init__(self, file: Path, warnings: tuple[str, ...] = ()) -> None:
        self._file = file
        self.warnings = list(warnings)
        self._write(f"pid {os.getpid()}")

    def block(self, block: Block) -> None:
        """Note how many rows there are."""
        self._write(f"rows {len(block)}")

    def event(self, event: Event) -> None:
        """Note its text."""
        self._write(f"event {event.text}")

    def close(self) -> None:
        """Note that too."""
        self._write("closed")

    def _write(self, line: str) -> None:
        with self._file.open("a", encoding="utf-8") as file:
            file.write(line + "\n")


class Refuses(Notes):
    """A sink that cannot be made."""

    def __init__(self, error: Exception) -> None:
        raise error


class Sleeps(Notes):
    """A sink that takes its time to be made."""

    def __init__(self, seconds: float) -> None:
        time.sleep(seconds)


class Strikes:
    """A sink in this process that does something at its first block after `at`, once."""

    def __init__(self, at: float, act: Callable[[], None]) -> None:
        self._at, self._act = at, act
        self.struck = False

    def block(self, block: Block) -> None:
        """Strike."""
        if not self.struck and block["t"][-1] >= self._at:
            self.struck = True
            self._act()

    def event(self, event: Event) -> None:
        """Ignore it."""

    def close(self) -> None:
        """Do nothing."""


def children() -> list[int]:
    """Return the processes that this one started and that are there."""
    return [
        int(word) for file in Path("/proc/self/task").glob("*/children") for word in file.read_text().split()
    ]


def strike_all(number: signal.Signals) -> None:
    """Send a signal to every process that this one started."""
    for pid in children():
        os.kill(pid, number)


def noted(file: Path, what: str) -> list[str]:
    """Return the lines of that kind, without the kind."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return [line.removeprefix(what).strip() for line in lines if line.startswith(what)]


@pytest.fixture(autouse=True)
def _no_process_stays() -> Iterator[None]:
    before = set(children()), set(Path("/dev/shm").iterdir())  # noqa: S108 - to see that nothing is left there
    yield
    assert set(children()) <= before[0]
    assert set(Path("/dev/shm").iterdir()) <= before[1]  # noqa: S108


def fill(apart: Apart, periods: int, first: int = 0) -> None:
    """Write periods as the loop does."""
    for k in range(first, first + periods):
        apart.ring.push(cycle(k * _T), UNKNOWN_TRUTH, _HELD)


# ---------------------------------------------------------------- what comes back


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
    assert result.columns["time_s"] == pytest.approx(_T * np.arange(1500))
    assert result.dropped == 0
    assert result.events[-1].level == "WARN"
    assert [event.text for event in result.events].count("amplifier at 0 V") == 1
    (sentence,) = told
    assert sentence in result.troubles[-1]
    assert ("SIGKILL" if number == signal.SIGKILL else "did not answer") in sentence
    assert "the figures are complete" in sentence


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_the_end_takes_two_seconds_at_most_in_any_state_of_the_process(number: signal.Signals) -> None:
    apart = Apart(Statistics(_T), keep=True)
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
    monkeypatch.setattr(module, "_CAPACITY", 256)
    told: list[str] = []
    apart = Apart(Statistics(_T), keep=True, warn=told.append)
    apart.open()
    assert apart.pid is not None
    os.kill(apart.pid, signal.SIGSTOP)
    fill(apart, 1000)
    apart.close()
    t = apart.figures.columns()["time_s"]
    assert apart.dropped == 1000 - len(t)
    assert t == pytest.approx(_T * np.arange(1000 - len(t), 1000))
    assert len(t) <= 256
    assert f"{apart.dropped} periods are in no figure" in told[0]


def test_events_never_block_and_come_back_although_they_are_not_read() -> None:
    apart = Apart(Statistics(_T), keep=True)
    apart.open()
    assert apart.pid is not None
    os.kill(apart.pid, signal.SIGSTOP)
    longest = 0.0
    for k in range(3000):  # more than a socket holds
        began = time.monotonic()
        apart.event(Event(k * _T, "INFO", EventKind.OTHER, f"event {k} " + "x" * 200))
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
        """Note nothing."""

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
    apart = Apart(Statistics(_T), keep=False, sinks=[pickle.dumps(partial(Sleeps, 1e6))], warn=told.append)
    apart.open(lambda: bool(told))
    assert apart.pid is None
    apart.close()
    assert told == ["The telemetry process is still starting after 0.3 s; Ctrl-C ends this."]


def test_a_process_that_works_at_its_figures_is_waited_for() -> None:
    told: list[str] = []
    apart = Apart(Statistics(_T), keep=True, sinks=[pickle.dumps(partial(Busy))], warn=told.append)
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


# ---------------------------------------------------------------- when we fail

_RUNS_ON = """
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from dcmp_hil import load_rig, run
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.rig_view import view_of
from tests.telemetry.test_apart import Notes
rig = load_rig("bench-1khz")
folder = Path(sys.argv[1])
dashboard = partial(RerunSink, rig=view_of(rig), record=folder / "run.rrd", viewer="none")
run(rig, duration=0, sinks=[dashboard, partial(Notes, folder / "notes")])
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_the_process_drains_the_ring_and_leaves_when_we_are_killed(
    tmp_path: Path, number: signal.Signals
) -> None:
    notes = tmp_path / "notes"
    with subprocess.Popen([sys.executable, "-c", _RUNS_ON, str(tmp_path)], stderr=subprocess.PIPE) as process:
        _wait(lambda: notes.exists() and len(noted(notes, "rows")) >= 5)
        process.send_signal(number)
        process.communicate(timeout=_BOUND)  # until every process with its standard error has ended, too
    pid = int(noted(notes, "pid")[0])
    _wait(lambda: not Path(f"/proc/{pid}").exists())
    assert noted(notes, "closed") == [""]
    periods = sum(map(int, noted(notes, "rows")))
    assert len(values(tmp_path / "run.rrd", "joint/position_rad")) == periods


def _wait(until: Callable[[], bool]) -> None:
    end = time.monotonic() + _BOUND
    while not until():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_full_disk_costs_one_warning(tmp_path: Path) -> None:
    maker: Callable[[], Sink] = partial(_limited, tmp_path / "run.rrd")
    result = run(load_rig("bench-1khz"), duration=3.0, sinks=[maker])
    assert result.summary.periods == 3000
    assert result.dropped == 0
    (trouble,) = result.troubles
    assert "incomplete" in trouble or "taken nothing" in trouble


def _limited(file: Path) -> Sink:
    """Make a recording that may not grow beyond what fits our own files in memory."""
    import resource

    sink = RerunSink(VIEW, file, "none")
    resource.setrlimit(resource.RLIMIT_FSIZE, (900_000, resource.RLIM_INFINITY))
    return sink
