"""Lateness of the loop's wake-up, compared with C in the same run, and the host's time per cycle."""

from __future__ import annotations

import gc
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections import deque
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil import load_rig, loop
from dcmp_hil.assembly import assemble
from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.session import Session
from dcmp_hil.wire import cobs
from sim_backend.backend import SimBackend
from sim_backend.board.board import Board
from tools.bench_telemetry import everything

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame

_SPREAD_RATIO_MAX = 2.0  # of C's own p99.9, largest over smallest, beyond which nothing can be judged
_PRIORITY = 80
_C_SOURCE = """
#define _GNU_SOURCE
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <time.h>
static int64_t now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec * 1000000000LL + t.tv_nsec;
}
int main(int count, char **words)
{
    if (count != 4) {
        return 2;
    }
    const double period = 1e9 / atof(words[1]);
    const int64_t ticks = atoll(words[2]);
    const struct sched_param parameter = {.sched_priority = atoi(words[3])};
    int64_t *const late = malloc((size_t)ticks * sizeof *late);
    memset(late, 1, (size_t)ticks * sizeof *late);
    prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0);
    mlockall(MCL_CURRENT);
    sched_setscheduler(0, SCHED_FIFO, &parameter);
    const int64_t start = now();
    for (int64_t k = 0; k < ticks; k++) {
        const int64_t deadline = start + (int64_t)((double)k * period + 0.5);
        const struct timespec until = {.tv_sec = deadline / 1000000000LL, .tv_nsec = deadline % 1000000000LL};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL)) {
        }
        late[k] = now() - deadline;
    }
    return fwrite(late, sizeof *late, (size_t)ticks, stdout) == (size_t)ticks ? 0 : 1;
}
"""


@dataclass(frozen=True, slots=True)
class Lateness:
    """Results of the runs at one rate, one figure per run."""

    rate: float  # Hz
    c: list[float]  # us, p99.9
    ours: list[float]
    recorded: list[float]  # us, p99.9, with recordings and the dashboard served
    rate_error: list[float]  # %, mean rate over the nominal one, less 1
    drift: list[float]  # us/s, from the medians of the first and the last tenth

    @property
    def c_spread(self) -> float:
        """Largest over smallest of C's."""
        return max(self.c) / min(self.c)

    def ratio(self, runs: Sequence[float]) -> tuple[float, float, float]:
        """Return the ratio of the medians to C's, and the smallest and largest of runs taken in turn."""
        pairs = [one / other for one, other in zip(runs, self.c, strict=True)]
        return statistics.median(runs) / statistics.median(self.c), min(pairs), max(pairs)

    @property
    def dashboard(self) -> tuple[float, float, float]:
        """The ratio of the medians with recordings and dashboard to those without, smallest and largest."""
        pairs = [one / other for one, other in zip(self.recorded, self.ours, strict=True)]
        return statistics.median(self.recorded) / statistics.median(self.ours), min(pairs), max(pairs)

    @property
    def goal(self) -> str:
        """Requirement on the ratio, or why there is none."""
        if self.c_spread > _SPREAD_RATIO_MAX:
            return f"<= 1.2; not judged: C's own spread is {self.c_spread:.1f}"
        return "<= 1.2"


def lateness(rate: float, rounds: int, seconds: float) -> Lateness:
    """Run C, the loop, and the loop with recordings and dashboard in turn; return the results."""
    found = Lateness(rate, [], [], [], [], [])
    with _compiled() as program:
        for _ in range(rounds):
            found.c.append(_p999(_c_run(program, rate, seconds)))
            ours = _our_run(rate, seconds, record=False)
            found.ours.append(_p999(ours))
            found.recorded.append(_p999(_our_run(rate, seconds, record=True)))
            tenth = len(ours) // 10
            begin, end = (float(np.median(part)) for part in (ours[:tenth], ours[-tenth:]))
            found.drift.append((end - begin) / (0.9 * seconds))
            found.rate_error.append(-1e-4 * float(ours[-1] - ours[0]) / seconds)
    return found


def _p999(late_us: NDArray[np.float64]) -> float:
    return float(np.percentile(late_us, 99.9))


def _us(output: bytes) -> NDArray[np.float64]:
    return 1e-3 * np.frombuffer(output, np.int64).astype(np.float64)


@contextmanager
def _compiled() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder) / "sleeper.c", Path(folder) / "sleeper"
        source.write_text(_C_SOURCE, "utf-8")
        compiler = os.environ.get("CC", "cc")
        subprocess.run([compiler, "-O2", "-o", program, source], check=True)  # noqa: S603 - our own
        yield program


def _c_run(program: Path, rate: float, seconds: float) -> NDArray[np.float64]:
    words = [str(program), str(rate), str(round(rate * seconds)), str(_PRIORITY)]
    done = subprocess.run(words, check=True, capture_output=True)  # noqa: S603 - our own
    return _us(done.stdout)


def _our_run(rate: float, seconds: float, *, record: bool) -> NDArray[np.float64]:
    """Run in a fresh process, as a user does."""
    code = f"from tools.bench_lateness import child; child({rate}, {seconds}, {record})"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)  # noqa: S603 - our own
    return _us(done.stdout)


# ---------------------------------------------------------------- the other process


class _Watch:
    """A clock that notes how late each sleep ended: what the C program notes."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.now_ns = clock.now_ns

    def sleep_until_ns(self, deadline_ns: int) -> None:
        """Sleep, and note."""
        self._clock.sleep_until_ns(deadline_ns)
        _late_ns.append(self.now_ns() - deadline_ns)


_late_ns: list[int] = []


def watched(rig: Rig, clock: Clock) -> SimBackend:
    """Make the simulated rig with a watch on its sleep."""
    return SimBackend(rig, _Watch(clock))


watched.simulated = True  # type: ignore[attr-defined]


def child(rate: float, seconds: float, record: bool) -> None:
    """Run the loop at the wall's pace, under what the system grants; write how late each sleep ended, ns."""
    rig = load_rig("bench-1khz", [f"loop.rate_hz={rate}", "backend.kind=tools.bench_lateness:watched"])
    with tempfile.TemporaryDirectory() as folder:
        sinks = everything(rig, Path(folder)) if record else []
        Session(rig, duration=seconds, sinks=sinks, keep_columns=False).run()
    sys.stdout.buffer.write(np.array(_late_ns, np.int64).tobytes())


# ---------------------------------------------------------------- what a period costs


class _Wire:
    """A link to a board in this process; the time of the board is taken out of each period's."""

    name = "wire"
    pending = False
    corrupt = 0
    other_carrier = ""

    def __init__(self, board: Board) -> None:
        self._board, self._receiver = board, cobs.CobsDecoder()
        self._frames: deque[Frame] = deque()
        self._mark = self._inside = 0.0
        self.periods: list[float] = []  # s, the host's part

    def open(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""

    def send(self, frame: Frame) -> None:
        """Hand a frame's bytes to the board."""
        data = cobs.encode(frame)
        began = time.perf_counter()
        self._board.receive(data)
        self._inside += time.perf_counter() - began

    def receive(self, timeout: float) -> Frame | None:
        """End a period, let the board tick, and begin the next with what it sent."""
        if timeout > 0.0 and not self._frames:
            now = time.perf_counter()
            self.periods.append(now - self._mark - self._inside)
            self._board.tick()
            data = self._board.transmit()
            self._mark, self._inside = time.perf_counter(), 0.0
            self._frames.extend(self._receiver.feed(data))
        return self._frames.popleft() if self._frames else None


class _NoTelemetry:
    requested = False


def period_us(seconds: float = 10.0) -> float:
    """Return the median cost of a period on the host, from the SAMPLE's bytes to the DRIVE's, and its record.

    Everything that a run on a serial port does but the system calls; no garbage collection, as in real time.
    The firmware's C and the plant are taken out, the stopwatch itself (0.3 us) is not.
    """
    rig, clock = load_rig("bench-1khz", ["backend.kind=sim-board"]), MonotonicClock()
    wire = _Wire(Board(rig, carrier="cobs"))
    line, _ = assemble(rig, clock, [], in_line=True)
    line = replace(line, backend=DeviceBackend(rig, wire, clock))
    with line.backend:
        handshake = len(wire.periods)
        gc.disable()
        try:
            loop.run(line, seconds, _NoTelemetry())
        finally:
            gc.enable()
        return 1e6 * statistics.median(wire.periods[handshake + 1000 :])
