"""Result of a soak, and the requirements that it violates."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from tools.soak.memory import Memory

GROWTH_MAX_MB_PER_MINUTE, TOTAL_MAX_MB = 0.2, 500.0
"""What a process may grow by in a simulated minute, and what all may take."""
_NOISE_MAX_MB = 4.0  # that two minutes may differ by without a leak
_LAST_LOOK_MINUTES = 2.0  # before the end, by which every process is still seen


@dataclass(slots=True)
class SoakResult:
    """Result of a soak.

    Parameters
    ----------
    minutes
        Simulated.
    wall_s
        What it took.
    cpu_s
        Of each process.
    memory
        Of each process.
    dropped, recorded, written
        Periods that are in no figure, that are in run.mcap, and that there were.
    mcap_mb, rrd_mb
        Size of the files.
    troubles
        What the run went on without.
    """

    minutes: float
    wall_s: float
    cpu_s: dict[str, float]
    memory: Memory
    dropped: int
    recorded: int
    written: int
    mcap_mb: float
    rrd_mb: float
    troubles: list[str]

    def faults(self) -> list[str]:
        """Return the requirements that the soak violates."""
        found = [
            f"{name}: {_grows_by(growth.slope())}"
            for name, growth in self.memory.growth.items()
            if not growth.slope() < GROWTH_MAX_MB_PER_MINUTE
        ]
        for name, growth in self.memory.growth.items():
            rise, minutes = growth.rise()
            if rise > GROWTH_MAX_MB_PER_MINUTE * minutes + _NOISE_MAX_MB:
                found.append(f"{name}: has {rise:.1f} MB more than {minutes:.0f} simulated minutes before")
            if max(growth.minutes) < self.minutes - _LAST_LOOK_MINUTES:
                found.append(f"{name}: not seen after minute {max(growth.minutes):.0f}, so it ended early")
        if not self.memory.peak_mb <= TOTAL_MAX_MB:
            found.append(f"all of them take {self.memory.peak_mb:.0f} MB")
        if self.dropped or self.recorded != self.written:
            found.append(f"{self.dropped} periods in no figure, {self.written - self.recorded} not recorded")
        return found + self.troubles

    def document(self) -> dict[str, object]:
        """Return the result as a document for JSON."""
        figures = {name: value for name, value in asdict(self).items() if name != "memory"}
        growth = self.memory.growth.items()
        return {
            **figures,
            "slope_mb_a_minute": {name: one.slope() for name, one in growth},
            "private_mb": {name: [round(mb, 1) for mb in one.by_minute()] for name, one in growth},
            "peak_total_mb": self.memory.peak_mb,
            "mcap_mb_a_minute": self.mcap_mb / self.minutes,
            "rrd_mb_a_minute": self.rrd_mb / self.minutes,
        }


def _grows_by(slope: float) -> str:
    if math.isnan(slope):
        return "no two minutes after the warm-up, so its growth is not known"
    return f"grows by {slope:.3f} MB a simulated minute"


def size_mb(file: Path) -> float:
    """Return the size of a file, MB."""
    return 1e-6 * file.stat().st_size


def periods_in(file: Path) -> int:
    """Count the periods of a recording, as its own end does."""
    from mcap.reader import make_reader

    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    if summary is None or summary.statistics is None:
        return 0
    topics = {number: channel.topic for number, channel in summary.channels.items()}
    counts = summary.statistics.channel_message_counts
    return sum(count for number, count in counts.items() if "cycle" in topics[number])
