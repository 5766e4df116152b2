"""Time that telemetry costs the loop, and an endurance run at 10 kHz with all sinks."""

from __future__ import annotations

import statistics
import tempfile
import threading
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil import load_rig
from dcmp_hil.assembly import assemble
from dcmp_hil.cli.run_sinks import dashboard, recording
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.recording.metadata import about, rig_json
from dcmp_hil.session import Session
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.viewer import free_port
from dcmp_hil.values import Cycle, Estimate, Reference, Sample, Timing

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.telemetry.sink_factories import SinkMaker

_FIRST_PORT = 29_000
_RECORDS_PER_ROUND, _ROUND_COUNT = 2000, 25


@dataclass(frozen=True, slots=True)
class Endurance:
    """Result of a long run with all sinks."""

    rate: float  # Hz
    dropped: int  # periods
    resident_mb: list[float]  # MB of the telemetry process, a second each
    mcap_mb_a_minute: float
    rrd_mb_a_minute: float


def everything(rig: Rig, folder: Path) -> list[SinkMaker]:
    """Return as many sinks as a run can have: its recording, the dashboard in a file and served."""
    port = free_port(_FIRST_PORT)
    if port is None:
        raise OSError(f"no free port from {_FIRST_PORT} on")
    return [
        partial(recording, folder / "run.mcap", rig.period, about(rig), rig_json(rig)),
        partial(dashboard, view_of(rig), folder / "run.rrd", "serve", port),
    ]


def record_us() -> float:
    """Return the median cost of one call of `record`: ring, black box, link."""
    rig = load_rig("bench-1khz", ["backend.kind=sim-board"])
    line, recorder = assemble(rig, SimulatedClock(), [], in_line=False)
    del line
    cycle = Cycle(
        Sample(1.0, 0.5, 1.0),
        Estimate(0.5, 0.1, 2.0),
        Reference(0.5, 0.1, 0.0),
        1.0,
        1.0,
        Timing(1e-3, 0.0, 1e-5),
    )
    costs = []
    for _ in range(_ROUND_COUNT):
        began = time.perf_counter()
        for _ in range(_RECORDS_PER_ROUND):
            recorder.record(cycle)
        costs.append(1e6 * (time.perf_counter() - began) / _RECORDS_PER_ROUND)
    return statistics.median(costs)


def endurance(rate: float = 10_000.0, seconds: float = 60.0) -> Endurance:
    """Run at a rate with everything on; look at the telemetry process once a second."""
    rig = load_rig("bench-1khz", [f"loop.rate_hz={rate}"])
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        session = Session(rig, duration=seconds, sinks=everything(rig, folder), keep_columns=False)
        watch = _Memory(session)
        watch.start()
        session.run()
        watch.ended.set()
        watch.join()
        result = session.result()
        sizes = [60e-6 / seconds * (folder / name).stat().st_size for name in ("run.mcap", "run.rrd")]
    return Endurance(rate, result.dropped, watch.resident_mb, *sizes)


class _Memory(threading.Thread):
    """Looks at the telemetry process from outside."""

    def __init__(self, session: Session) -> None:
        super().__init__(daemon=True)
        self._session = session
        self.ended = threading.Event()
        self.resident_mb: list[float] = []

    def run(self) -> None:
        """Take a measurement once a second."""
        while not self.ended.wait(1.0):
            pid = self._session.telemetry_pid
            status = Path(f"/proc/{pid}/status")
            if pid is not None and status.exists():
                lines = status.read_text("utf-8").splitlines()
                self.resident_mb += [
                    1e-3 * int(line.split()[1]) for line in lines if line.startswith("VmRSS")
                ]
