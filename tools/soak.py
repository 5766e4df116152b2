"""`make soak-long`: hours of a run's data by rate through the real processes, and what their memory does.

A minute of simulated rows is written into the ring over and over, many times faster than real time: from
there they go their usual way, through the telemetry process (figures, run.mcap, run.rrd, a dashboard that is
served) and past the control process, which has a watcher. Where a sink is far behind, the source waits, so
that a busy computer makes a soak longer and loses nothing. Memory is PSS, as the kernel counts it, once a
simulated minute.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil import load_rig, run
from dcmp_hil.cli.onlookers import recording
from dcmp_hil.live.places import socket_of
from dcmp_hil.live.process import ControlProcess
from dcmp_hil.recording.about import about, rig_json
from dcmp_hil.telemetry.apart import Apart
from dcmp_hil.telemetry.makers import sorted_out
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.viewer import free_port
from dcmp_hil.telemetry.statistics import Statistics
from dcmp_hil.values import ChangeData, Event, EventKind, LinkData

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.ipc.ring import Ring
    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.makers import SinkMaker

SETTLING = 5.0
"""Simulated minutes before memory counts."""
SLOPE_MB, TOTAL_MB = 0.2, 500.0
"""What a process may grow by in a simulated minute after that, and what all may take."""
_PORT = 30_000
_FAR = 8_000  # rows: a quarter of the ring
_LOOK_S = 5.0  # s of data between two looks at memory
_BATCH_S = 0.1  # s of data that are written at once


@dataclass(slots=True)
class Memory:
    """PSS of one process, MB, by simulated minute."""

    minutes: list[float] = field(default_factory=list)
    pss_mb: list[float] = field(default_factory=list)

    def look(self, minute: float, pid: int) -> None:
        """Ask the kernel."""
        with suppress(OSError):
            for line in Path(f"/proc/{pid}/smaps_rollup").read_text("ascii").splitlines():
                if line.startswith("Pss:"):
                    self.minutes.append(minute)
                    self.pss_mb.append(1e-3 * float(line.split()[1]))

    def floor(self) -> list[float]:
        """Return the least of each minute: what waits in queues comes and goes, a leak stays."""
        whole = np.floor(self.minutes)
        return [float(np.array(self.pss_mb)[whole == minute].min()) for minute in np.unique(whole)]

    def slope(self) -> float:
        """Return the median slope of all pairs of minutes after the first ones (Theil, Sen), MB a minute."""
        y = np.array(self.floor())
        x = np.unique(np.floor(self.minutes))
        x, y = x[x >= SETTLING], y[x >= SETTLING]
        first, second = np.triu_indices(len(x), 1)
        if not len(first):
            return float("nan")
        return float(np.median((y[second] - y[first]) / (x[second] - x[first])))


@dataclass(slots=True)
class Soaked:
    """What a soak came to."""

    minutes: float
    wall_s: float
    cpu_s: dict[str, float]
    slope_mb_a_minute: dict[str, float]
    pss_mb: dict[str, list[int]]
    peak_total_mb: float
    dropped: int
    recorded: int
    written: int
    mcap_mb_a_minute: float
    rrd_mb_a_minute: float
    troubles: list[str]

    def faults(self, slope_mb: float) -> list[str]:
        """Return what must not be, such as a slope above `slope_mb` (MB a simulated minute)."""
        found = [
            f"{name} grows by {slope:.3f} MB a simulated minute"
            for name, slope in self.slope_mb_a_minute.items()
            if not slope < slope_mb
        ]
        if self.peak_total_mb > TOTAL_MB:
            found.append(f"all of them take {self.peak_total_mb:.0f} MB")
        if self.dropped or self.recorded != self.written:
            found.append(f"{self.dropped} periods in no figure, {self.written - self.recorded} not recorded")
        return found + self.troubles


class _Rows:
    """Keeps the rows of a run."""

    def __init__(self) -> None:
        self.rows: list[NDArray[np.float64]] = []

    def block(self, block: Block) -> None:
        """Keep a copy of the block's rows."""
        self.rows.append(block.rows.copy())

    def event(self, event: Event) -> None:
        """Ignore the event."""

    def close(self) -> None:
        """Nothing to finish."""


def a_minute(rig: Rig) -> NDArray[np.float64]:
    """Return the rows of a minute of a rig in virtual time."""
    sink = _Rows()
    run(rig, duration=60.0, fast=True, sinks=[sink])
    return np.concatenate(sink.rows)


class _Source:
    """Writes rows into a ring, many at once, as the loop does one by one."""

    def __init__(self, ring: Ring, rows: NDArray[np.float64]) -> None:
        self._ring, self._rows = ring, rows
        self.written = 0

    def write(self, count: int) -> float:
        """Write the next rows; return the device time of the last, s."""
        numbers = np.arange(self.written, self.written + count)
        again, place = np.divmod(numbers, len(self._rows))
        rows = self._rows[place]
        rows[:, 0] += 60.0 * again
        slots = numbers % self._ring.capacity
        memory = self._ring._rows  # noqa: SLF001 - as `push` does, only many
        memory[slots, 0] = numbers
        memory[slots, 1:] = rows
        self.written += count
        self._ring._count[0] = self.written  # noqa: SLF001
        return float(rows[-1, 0])


@contextmanager
def _watching(pid: int) -> Iterator[None]:
    """Take the states of a run, as a panel does."""
    end = time.monotonic() + 30.0
    while not (path := socket_of(pid)).exists() and time.monotonic() < end:
        time.sleep(0.05)
    with socket.socket(socket.AF_UNIX) as watcher:
        watcher.connect(str(path))
        watcher.sendall(b'{"do": "watch"}\n')

        def read() -> None:
            with suppress(OSError):
                while watcher.recv(1 << 16):
                    pass

        threading.Thread(target=read, daemon=True).start()
        yield
        with suppress(OSError):
            watcher.shutdown(socket.SHUT_RDWR)


def soak(minutes: float, speed: float, folder: Path, history: str) -> Soaked:
    """Let so many simulated minutes go through, `speed` times faster than real time."""
    rig = load_rig("bench-1khz")
    makers: list[SinkMaker] = [
        partial(recording, folder / "run.mcap", rig.period, about(rig), rig_json(rig)),
        partial(
            RerunSink,
            view_of(rig),
            folder / "run.rrd",
            "serve" if history else "none",
            port=next_port(),
            spare=True,
            history=history or "0B",
        ),
    ]
    rows = a_minute(rig)
    troubles: list[str] = []
    apart = Apart(
        Statistics(rig.period), keep=False, sinks=sorted_out(makers)[1], warn=troubles.append,
        model=rig.model.values(), speed=speed,
    )  # fmt: skip
    control = ControlProcess()
    source = _Source(apart.ring, rows)
    apart.open()
    control.open(rig, apart.ring_file, troubles.append)
    if apart.pid is None or control.pid is None:
        raise OSError("; ".join(troubles))
    pids = {"control side": os.getpid(), "telemetry process": apart.pid, "control process": control.pid}
    memory = {name: Memory() for name in pids}
    peak, began, t = 0.0, time.monotonic(), 0.0
    with _watching(os.getpid()):
        for batch in range(round(minutes * 60.0 / _BATCH_S)):
            late = began + batch * _BATCH_S / speed - time.monotonic()
            if late > 0:
                time.sleep(late)
            while apart.behind > _FAR:
                time.sleep(0.005)
            t = source.write(round(_BATCH_S / rig.period))
            for event in events(batch, t):
                apart.event(event)
            if batch % round(_LOOK_S / _BATCH_S) == 0:
                for name, pid in pids.items():
                    memory[name].look(t / 60.0, pid)
                peak = max(peak, sum(one.pss_mb[-1] for one in memory.values()))
        wall = time.monotonic() - began
        cpu = {name: _cpu_s(pid) for name, pid in pids.items()}
    apart.close()
    control.close("The soak is over.", confirmed=True)
    _wait_for_end(pids["telemetry process"])
    troubles += apart.figures.troubles
    recorded = _periods_in(folder / "run.mcap")
    return Soaked(
        minutes, wall, cpu,
        {name: one.slope() for name, one in memory.items()},
        {name: [round(mb) for mb in one.floor()] for name, one in memory.items()},
        peak, apart.dropped, recorded, source.written,
        _mb(folder / "run.mcap") / minutes, _mb(folder / "run.rrd") / minutes, troubles,
    )  # fmt: skip


def real(minutes: float, folder: Path) -> Soaked:
    """Let `dcmp-hil run` run for so many minutes, and look at its processes."""
    command = [
        "run",
        "bench-1khz",
        "--duration",
        str(60.0 * minutes),
        "--viewer",
        "serve",
        "--json",
        "figures.json",
    ]
    memory: dict[str, Memory] = {}
    began, peak = time.monotonic(), 0.0
    with subprocess.Popen([sys.executable, "-m", "dcmp_hil", *command], cwd=folder) as process:  # noqa: S603 - our own
        cpu: dict[str, float] = {}
        while process.poll() is None:
            time.sleep(min(60.0, 6.0 * minutes))
            for name, pid in _processes(process.pid).items():
                memory.setdefault(name, Memory()).look((time.monotonic() - began) / 60.0, pid)
                with suppress(OSError):
                    cpu[name] = _cpu_s(pid)
            peak = max(peak, sum(one.pss_mb[-1] for one in memory.values() if one.pss_mb))
    figures = json.loads((folder / "figures.json").read_text("utf-8"))
    (kept,) = (folder / "runs").iterdir()
    troubles = [f"it ended with exit code {process.returncode}"] if process.returncode else []
    return Soaked(
        minutes, time.monotonic() - began, cpu,
        {name: one.slope() for name, one in memory.items()},
        {name: [round(mb) for mb in one.floor()] for name, one in memory.items()},
        peak, figures["dropped_periods"], _periods_in(kept / "run.mcap"), figures["periods"],
        _mb(kept / "run.mcap") / minutes, _mb(kept / "run.rrd") / minutes, troubles,
    )  # fmt: skip


def _processes(run: int) -> dict[str, int]:
    """Return the processes of a run that goes on, by what they are."""
    found = {"run": run}
    with suppress(OSError):
        for pid in map(int, Path(f"/proc/{run}/task/{run}/children").read_text("ascii").split()):
            command = Path(f"/proc/{pid}/cmdline").read_bytes()
            found["telemetry process" if b"telemetry.child" in command else "control process"] = pid
    return found


def events(batch: int, t: float) -> list[Event]:
    """Return what a run says: counters once a second, a change every ten."""
    found = []
    if batch % 10 == 0:
        found.append(Event(t, "DEBUG", EventKind.LINK, "lost=0", LinkData({"lost": 0, "late": batch})))
    if batch % 100 == 0:
        value = 4000.0 + batch % 7
        said = f"controller.kp_1_s2: 4000 -> {value:g}"
        found.append(Event(t, "INFO", EventKind.CHANGE, said, ChangeData({"controller.kp_1_s2": value})))
    return found


def next_port() -> int:
    """Return a port for the dashboard."""
    port = free_port(_PORT)
    if port is None:
        raise OSError(f"no free port from {_PORT} on")
    return port


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _mb(file: Path) -> float:
    return 1e-6 * file.stat().st_size


def _wait_for_end(pid: int) -> None:
    """Wait until a process has written its files: on a busy computer longer than the end of a run waits."""
    with suppress(OSError):
        for _ in range(600):
            if Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[0] == "Z":
                return
            time.sleep(0.1)


def _periods_in(file: Path) -> int:
    """Count the periods of a recording, as its own end does."""
    from mcap.reader import make_reader

    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    if summary is None or summary.statistics is None:
        return 0
    topics = {number: channel.topic for number, channel in summary.channels.items()}
    counts = summary.statistics.channel_message_counts
    return sum(count for number, count in counts.items() if "cycle" in topics[number])


def main() -> None:
    """Soak, print, and say what must not be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=480.0, help="of simulated time")
    parser.add_argument("--speed", type=float, default=40.0, help="times real time, at most")
    parser.add_argument(
        "--history", default="64MiB", help="that the dashboard's server keeps for late viewers"
    )
    parser.add_argument("--slope", type=float, default=SLOPE_MB, help="MB a simulated minute, at most")
    parser.add_argument("--real", action="store_true", help="`dcmp-hil run`, by the wall clock")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        if options.real:
            soaked = real(options.minutes, folder)
        else:
            soaked = soak(options.minutes, options.speed, folder, options.history)
    sys.stdout.write(json.dumps(asdict(soaked)) + "\n")
    if faults := soaked.faults(options.slope):
        sys.exit("; ".join(faults))


if __name__ == "__main__":
    main()
