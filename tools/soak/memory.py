"""Memory of processes while a soak goes on, and what it grows by."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

SETTLING_TIME_MINUTES = 5.0
"""Simulated minutes before memory counts."""


@dataclass(slots=True)
class Growth:
    """Memory of one process, MB, by simulated minute."""

    minutes: list[float] = field(default_factory=list)
    mb: list[float] = field(default_factory=list)

    def add(self, minute: float, mb: float) -> None:
        """Add the present memory."""
        self.minutes.append(minute)
        self.mb.append(mb)

    def by_minute(self) -> list[float]:
        """Return the least of each minute: what waits in queues comes and goes, a leak stays."""
        return self._floor()[1].tolist()

    def slope(self) -> float:
        """Return the median slope of all pairs of minutes after the first ones (Theil, Sen), MB a minute.

        NaN if there are fewer than two.
        """
        x, y = self._floor()
        x, y = x[x >= SETTLING_TIME_MINUTES], y[x >= SETTLING_TIME_MINUTES]
        first, second = np.triu_indices(len(x), 1)
        if not len(first):
            return float("nan")
        return float(np.median((y[second] - y[first]) / (x[second] - x[first])))

    def rise(self) -> tuple[float, float]:
        """Return what the last minute has more than the first one after the warm-up, MB, and minutes between.

        A slope of medians does not see memory that is lost at once, or late.
        """
        x, y = self._floor()
        x, y = x[x >= SETTLING_TIME_MINUTES], y[x >= SETTLING_TIME_MINUTES]
        return (float(y[-1] - y[0]), float(x[-1] - x[0])) if len(x) else (0.0, 0.0)

    def _floor(self) -> tuple[np.ndarray[tuple[int], np.dtype[np.float64]], ...]:
        whole = np.floor(self.minutes)
        minutes = np.unique(whole)
        least = [np.array(self.mb)[whole == minute].min() for minute in minutes]
        return minutes, np.array(least, np.float64)


class Memory:
    """Memory of several processes, by simulated minute.

    What counts as growth is what a process has for itself: its anonymous pages, in memory or swapped out. The
    files in memory that the processes share (ring, ledger, logs) count once, apart from them. Pages of
    programs and libraries do not count: they are the page cache's, and the share of them that PSS charges to
    a process changes by 10 MB when an unrelated process with the same libraries starts or ends. What they
    take in all is PSS.

    Attributes
    ----------
    growth
        Of each process by its name, and of the shared files.
    peak_mb
        PSS of all of them, the most that was seen.
    """

    def __init__(self) -> None:
        self.growth: dict[str, Growth] = {}
        self.peak_mb = 0.0

    def look(self, minute: float, processes: dict[str, int], sharing: int) -> None:
        """Measure the memory of all processes.

        Parameters
        ----------
        minute
            Simulated.
        processes
            Name to process id; one that has ended is left out.
        sharing
            The process whose shared files count.
        """
        total = 0.0
        for name, pid in processes.items():
            with suppress(OSError):
                pages = _smaps(pid)
                self._add(name, minute, pages["Anonymous"] + pages["Swap"])
                total += pages["Pss"]
        self._add("shared files", minute, _shared_mb(sharing))
        self.peak_mb = max(self.peak_mb, total)

    def look_at_total(self, processes: dict[str, int]) -> None:
        """Measure the memory of all processes together."""
        with suppress(OSError):
            self.peak_mb = max(self.peak_mb, sum(_smaps(pid)["Pss"] for pid in processes.values()))

    def _add(self, name: str, minute: float, mb: float) -> None:
        self.growth.setdefault(name, Growth()).add(minute, mb)


def has_ended(pid: int) -> bool:
    """Return whether a process is gone, or only its parent has not noticed yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[0] in {"Z", "X"}
    except OSError:
        return True


def cpu_s(pid: int) -> float:
    """Return the CPU time of a process, s."""
    fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _smaps(pid: int) -> dict[str, float]:
    """Return the memory figures of the kernel, MB."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text("ascii").splitlines()[1:]
    return {name: 1e-3 * float(rest.split()[0]) for name, _, rest in (line.partition(":") for line in lines)}


def _shared_mb(pid: int) -> float:
    """Return the size of the nameless files in memory that a process has open, MB."""
    sizes: dict[int, int] = {}
    with suppress(OSError):
        for descriptor in Path(f"/proc/{pid}/fd").iterdir():
            with suppress(OSError):
                if "memfd:" in str(descriptor.readlink()):
                    found = descriptor.stat()
                    sizes[found.st_ino] = 512 * found.st_blocks
    return 1e-6 * sum(sizes.values())
