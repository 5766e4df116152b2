"""A minute of simulated rows, written into the ring over and over, many times faster than real time.

From there they go their usual way, through the telemetry process (figures, run.mcap, run.rrd, a dashboard
that is served) and past the command process, which has a watcher. Where a sink is far behind, the source
waits, so that a busy computer makes a soak longer and loses nothing.

Once a simulated minute the source waits until all rows are in the files, and memory is looked at then: up to
32 s of data wait for Rerun's thread, 15 MB, and how many at a given instant is chance.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil import load_rig
from dcmp_hil.cli.run_sinks import recording
from dcmp_hil.ipc.run_end import AT_ZERO
from dcmp_hil.live.command_process import CommandProcess
from dcmp_hil.live.run_sockets import socket_of
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.viewer import free_port
from dcmp_hil.telemetry.sink_factories import sorted_out
from dcmp_hil.telemetry.statistics import Statistics
from dcmp_hil.telemetry.telemetry_process import TelemetryProcess
from tools.soak.memory import Memory, cpu_s, has_ended
from tools.soak.result import SoakResult, periods_in, size_mb
from tools.soak.source import Leak, Source, a_minute, events

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.config import Rig
    from dcmp_hil.telemetry.sink_factories import SinkMaker

_FIRST_PORT = 30_000
_WAITING_ROWS_MAX = 8_000  # a quarter of the ring
_BATCH_DURATION_S = 0.1  # of data that is written at once
_BATCHES_PER_MINUTE = round(60.0 / _BATCH_DURATION_S)
_TOTAL_PERIOD_BATCHES = 200  # 20 s of data between two looks at what all processes take
_QUIET_TIME_S = 0.25  # during which no file grows: free memory is given back five times meanwhile
_QUIET_TIMEOUT_S = 30.0
_POLL_PERIOD_S = 0.05


def soak(minutes: float, speed: float, folder: Path, history: str, leak: float = 0.0) -> SoakResult:
    """Run data through telemetry; return the result.

    Parameters
    ----------
    minutes
        Simulated.
    speed
        Times real time, at most.
    folder
        For the files.
    history
        What the dashboard's server keeps, such as ``64MiB``; no server if it is empty.
    leak
        MB a minute that the telemetry process is made to leak.
    """
    rig = load_rig("bench-1khz")
    troubles: list[str] = []
    apart = TelemetryProcess(
        Statistics(rig.period), keep=False, sinks=sorted_out(_makers(rig, folder, history, leak))[1],
        warn=troubles.append, model=rig.model.values(), speed=speed,
    )  # fmt: skip
    commands = CommandProcess()
    source = Source(apart.ring, a_minute(rig))
    apart.open()
    commands.open(rig, apart.ring_file, troubles.append)
    if apart.pid is None or commands.pid is None:
        raise OSError("; ".join(troubles))
    pids = {"control side": os.getpid(), "telemetry process": apart.pid, "command process": commands.pid}
    memory, began = Memory(), time.monotonic()
    with _watching(os.getpid()):
        for batch in range(round(minutes * _BATCHES_PER_MINUTE)):
            late = began + batch * _BATCH_DURATION_S / speed - time.monotonic()
            if late > 0:
                time.sleep(late)
            while apart.behind > _WAITING_ROWS_MAX and not has_ended(apart.pid):
                time.sleep(0.005)
            t = source.write(round(_BATCH_DURATION_S / rig.period))
            for event in events(batch, t):
                apart.event(event)
            if batch % _BATCHES_PER_MINUTE == _BATCHES_PER_MINUTE - 1:
                _wait_until_quiet(apart, folder)
                memory.look((batch + 1) / _BATCHES_PER_MINUTE, pids, os.getpid())
            elif batch % _TOTAL_PERIOD_BATCHES == 0:
                memory.look_at_total(pids)
        wall = time.monotonic() - began
        cpu = {name: cpu_s(pid) for name, pid in pids.items()}
    apart.close()
    commands.close("The soak is over.", AT_ZERO)
    _wait_for_end(pids["telemetry process"])
    troubles += apart.figures.troubles
    return SoakResult(
        minutes, wall, cpu, memory, apart.dropped, periods_in(folder / "run.mcap"), source.written,
        size_mb(folder / "run.mcap"), size_mb(folder / "run.rrd"), troubles,
    )  # fmt: skip


def _makers(rig: Rig, folder: Path, history: str, leak: float) -> list[SinkMaker]:
    port = free_port(_FIRST_PORT)
    if port is None:
        raise OSError(f"no free port from {_FIRST_PORT} on")
    makers: list[SinkMaker] = [
        partial(recording, folder / "run.mcap", rig.period, about(rig), rig_json(rig)),
        partial(
            RerunSink,
            view_of(rig),
            folder / "run.rrd",
            "serve" if history else "none",
            port=port,
            spare=True,
            history=history or "0B",
        ),
    ]
    return [*makers, partial(Leak, leak)] if leak else makers


def _wait_until_quiet(apart: TelemetryProcess, folder: Path) -> None:
    """Wait until the sinks have taken all there is and the files do not grow any more."""
    now = time.monotonic()
    quiet_from, end, sizes = now, now + _QUIET_TIMEOUT_S, [0]
    while now - quiet_from < _QUIET_TIME_S and now < end:
        time.sleep(_POLL_PERIOD_S)
        now, before = time.monotonic(), sizes
        sizes = [file.stat().st_size for file in sorted(folder.iterdir())]
        if apart.behind or sizes != before:
            quiet_from = now


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


def _wait_for_end(pid: int) -> None:
    """Wait until a process has written its files: on a busy computer longer than the end of a run waits."""
    for _ in range(600):
        if has_ended(pid):
            return
        time.sleep(0.1)
