"""The dashboard: what arrives in a recording, and what a missing viewer or a full disk costs."""

from __future__ import annotations

import dataclasses
import socket
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import rerun as rr

from dcmp_hil.config import load_rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.ring import Ring
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.telemetry.dispatcher import SinkDispatcher
from dcmp_hil.telemetry.plot_labels import title
from dcmp_hil.telemetry.rerun import sink as rerun_sink
from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.stream_worker import StreamWorker
from tests.telemetry.runs import (
    EVENTS,
    VIEW,
    T,
    blocks,
    cycle,
    entities,
    feed,
    periods_of,
    read_back,
    truth,
    values,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from dcmp_hil.telemetry.rerun.stream_worker import Job


@pytest.fixture(autouse=True)
def _strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture
def _no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


def test_an_arm_that_shows_the_true_position_at_50_hz(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    feed(RerunSink(VIEW, record, "none"))
    table = read_back(record, "rig/arm")
    assert periods_of(table) == list(range(0, 1000, 20))
    quaternions = np.array(table["Transform3D:quaternion"]).reshape(-1, 4)
    angles = 2.0 * np.arctan2(quaternions[:, 2], quaternions[:, 3])
    assert angles == pytest.approx(np.sin(T * np.arange(0, 1000, 20)), abs=1e-6)


def test_phases_events_and_states(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    columns = feed(RerunSink(VIEW, record, "none"))
    phase, log = read_back(record, "phase"), read_back(record, "events/log")
    assert phase["StateChange:state"] == [["settling"], ["engaging"], ["running"]]
    assert periods_of(phase) == [0, 250, 500]
    assert log["TextLog:text"] == [[event.text] for event in EVENTS[3:]]
    assert log["TextLog:level"] == [["WARN"], ["INFO"]]
    voltage = read_back(record, "voltage")
    assert voltage["StateChange:state"] == [["within limits"], ["at the limit"], ["within limits"]]
    at_limit = np.flatnonzero(columns["voltage_sent_V"] == 10.0)
    assert periods_of(voltage) == [0, at_limit[0], at_limit[-1] + 1]
    samples = read_back(record, "samples")
    assert periods_of(samples)[:3] == [0, 96, 97]
    assert samples["StateChange:state"][:3] == [["on time"], ["late"], ["on time"]]


def test_histogram_counts_every_known_period(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    feed(RerunSink(VIEW, record, "none"), periods=2100)
    table: dict[str, list[Any]] = read_back(record, "loop/period_hist")
    last: Any = table["BarChart:values"][-1]
    assert sum(last[0]["buffer"]) == periods_of(table)[-1]
    assert len(periods_of(table)) >= 2
    for what in ("lateness", "compute"):  # the first period has these
        bars: Any = read_back(record, f"loop/{what}_hist")["BarChart:values"][-1]
        assert sum(bars[0]["buffer"]) == periods_of(table)[-1] + 1


def test_limits_parameters_and_pendulum_are_there(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    feed(RerunSink(VIEW, record, "none"), periods=200)
    assert {tuple(row) for row in values(record, "control/voltage_V/range").tolist()} == {(10.0, -10.0)}
    assert r"| **controller** |  |\n| kp_1_s2 | 4000 |" in str(
        read_back(record, "params")["TextDocument:text"]
    )
    assert {"rig/arm/rod", "rig/reference/outline", "rig/motor", "rig/dial"} <= entities(record)


def test_the_limit_is_drawn_from_end_to_end_of_a_long_block(tmp_path: Path) -> None:
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    (whole,) = blocks(3000, rows=4096)  # as in virtual time
    sink.block(whole)
    sink.close()
    ticks = periods_of(read_back(tmp_path / "run.rrd", "control/voltage_V/range"))
    assert ticks == [0, 1000, 2000, 2999]


def test_no_limit_no_lines(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    feed(RerunSink(dataclasses.replace(VIEW, voltage_limit=None), record, "none"), periods=200)
    assert not {"control/voltage_V/range"} & entities(record)


def test_view_of_a_rig_lists_every_key_and_the_gains_first() -> None:
    view = view_of(load_rig("bench-1khz", []))
    assert (view.name, view.voltage_limit, view.simulated, view.period) == ("bench-1khz", 10.0, True, 1e-3)
    assert view.parameters[0][0].startswith("controller.")
    assert "name" not in dict(view.parameters)
    assert view_of(load_rig("paper", [])).voltage_limit is None


def test_titles_have_units() -> None:
    assert title("joint/disturbance_rad_s2") == "Disturbance [rad/s²]"
    assert title("control/torque_N_m") == "Torque [N·m]"
    assert title("loop/timing_us") == "Timing [µs]"
    assert title("a/plain_name") == "Plain name"


def test_unwritable_recording_is_a_config_error_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no/run\.rrd: No such file.* Choose a file"):
        RerunSink(VIEW, tmp_path / "no" / "run.rrd", "none")


def test_a_recording_does_not_begin_where_its_beginning_has_no_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rerun would wait for ever in the main thread, where not even SIGTERM is heard."""
    begun: list[object] = []
    monkeypatch.setattr(rerun_sink, "room_for", lambda _: 98_304.0)
    monkeypatch.setattr(rerun_sink, "begin", lambda *_: begun.append(1))
    with pytest.raises(ConfigError, match=r"room for 98 kB.* Free some space.*--no-record"):
        RerunSink(VIEW, tmp_path / "run.rrd", "none")
    assert not begun


@pytest.mark.usefixtures("_no_display")
def test_spawn_without_a_display_warns_and_goes_on(tmp_path: Path) -> None:
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "spawn")
    assert "there is no display" in sink.warnings[0]
    assert sink.port is None
    feed(sink, periods=100)
    assert len(values(tmp_path / "run.rrd", "joint/position_rad/lines")) == 100


def test_connect_without_a_viewer_warns_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as free:
        free.bind((window.LOOPBACK, 0))
        monkeypatch.setattr(window, "VIEWER_PORT", free.getsockname()[1])
    before_ns = MonotonicClock().now_ns()
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "connect")
    assert MonotonicClock().now_ns() - before_ns < 5e9
    assert "goes on without one" in sink.warnings[0]
    feed(sink, periods=100)
    assert len(values(tmp_path / "run.rrd", "joint/position_rad/lines")) == 100


def test_connect_to_a_server_that_accepts_and_stays_silent_warns(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as mute:  # as a frozen viewer does
        mute.bind((window.LOOPBACK, 0))
        mute.listen()
        monkeypatch.setattr(window, "VIEWER_PORT", mute.getsockname()[1])
        assert window.answers(window.VIEWER_PORT, 10.0)
        sink = RerunSink(VIEW, None, "connect")
    assert "goes on without one" in sink.warnings[0]
    sink.close()


class _Stuck(StreamWorker):
    """An outlet to a viewer that takes nothing."""

    def do(self, job: Job) -> bool:  # noqa: ARG002
        """Find no room."""
        return False


def test_a_viewer_that_takes_nothing_is_left_behind_and_the_file_stays_whole(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    monkeypatch.setattr(rerun_sink, "StreamWorker", _Stuck)
    sink._open_viewer(rr.GrpcSink("rerun+http://127.0.0.1:1/proxy"), 1.0)  # noqa: SLF001
    ring = Ring(4096)
    audience = SinkDispatcher(ring, [sink])  # which hands a warning to every sink, this one too
    for k in range(500):
        ring.push(cycle(k), truth(k))
        if k % 100 == 99:
            audience.dispatch()
    audience.finish()
    assert len(sink.warnings) == 1
    assert "the run goes on" in sink.warnings[0]
    assert len(values(tmp_path / "run.rrd", "joint/position_rad/lines")) == 500
    assert "is left behind" in str(read_back(tmp_path / "run.rrd", "events/log")["TextLog:text"])


def test_a_busy_port_is_passed_over() -> None:
    with socket.socket() as busy:
        busy.bind((window.LOOPBACK, 0))
        busy.listen()
        port = busy.getsockname()[1]
        found = window.free_port(port)
        assert found is not None
        assert found > port
        assert window.answers(port, 10.0)


def test_no_free_port_and_a_missing_viewer_are_warnings(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(port: int) -> None:
        raise FileNotFoundError(f"no viewer for {port}")

    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(window, "start_viewer", missing)
    monkeypatch.setattr(rerun_sink, "display_problem", lambda: "")
    sink = RerunSink(VIEW, None, "spawn", port=24_100)
    sink.close()
    assert "The viewer did not start (no viewer for" in sink.warnings[0]
    monkeypatch.setattr(window, "free_ports", lambda _: iter([]))
    assert "No port from 24100 on is free" in RerunSink(VIEW, None, "spawn", port=24_100).warnings[0]


_DISK_FULL = """
import resource, sys
from contextlib import suppress
from pathlib import Path
from dcmp_hil.cli.forced_exit import leave
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.telemetry.runs import VIEW, feed
sink = RerunSink(VIEW, Path(sys.argv[1]), "none")
resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
with suppress(RuntimeError):  # the end of a run may come before its disk is noticed
    feed(sink, periods=20_000)
leave(0)  # as a command does: Python ends a thread that is stuck in Rerun by an abort
"""


def test_a_disk_that_fills_up_never_reaches_the_run(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    done = subprocess.run([sys.executable, "-c", _DISK_FULL, str(record)], timeout=60, check=False)
    assert done.returncode == 0
    assert 300_000 < record.stat().st_size <= 400_000


def test_nothing_follows_from_an_empty_block(tmp_path: Path) -> None:
    sink = RerunSink(VIEW, tmp_path / "run.rrd", "none")
    block = blocks(1)[0]
    block.rows = block.rows[:0]
    sink.block(block)
    sink.close()
    assert "joint/position_rad/lines" not in entities(tmp_path / "run.rrd")
