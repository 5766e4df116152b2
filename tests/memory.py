"""The largest resident memory of a process's own program, as Linux counts it.

`getrusage` is not asked: its `ru_maxrss` outlives `exec`, so a child that a large process starts begins with
the peak of its parent.
"""

from __future__ import annotations

from pathlib import Path


def peak_mb(pid: int | None = None) -> float:
    """Return the peak of the resident memory of a process in MB; without a number, of this one."""
    lines = Path(f"/proc/{pid or 'self'}/status").read_text().splitlines()
    return next(1e-3 * float(line.split()[1]) for line in lines if line.startswith("VmHWM"))


def forget_peak() -> float:
    """Let the peak of this process begin anew; return its present resident memory in MB."""
    Path("/proc/self/clear_refs").write_text("5")
    return peak_mb()
