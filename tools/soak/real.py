"""`dcmp-hil run` by the wall clock, with everything on."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

from dcmp_hil.live import command_server
from dcmp_hil.telemetry import telemetry_worker
from tools.soak.memory import Memory, cpu_s
from tools.soak.result import SoakResult, periods_in, size_mb

_POLL_PERIOD_S = 5.0
_PROGRAMS = {telemetry_worker.__name__: "telemetry process", command_server.__name__: "command process"}
"""Module that a child of a run imports, to what it is called."""


def real(minutes: float, folder: Path) -> SoakResult:
    """Run `dcmp-hil run` for so many minutes, and measure its processes."""
    command = [sys.executable, "-m", "dcmp_hil", "run", "bench-1khz", "--duration", str(60.0 * minutes)]
    command += ["--viewer", "serve", "--json", "figures.json"]
    memory, cpu, began = Memory(), dict[str, float](), time.monotonic()
    with subprocess.Popen(command, cwd=folder) as process:  # noqa: S603 - our own
        while process.poll() is None:
            time.sleep(_POLL_PERIOD_S)
            processes = _processes(process.pid)
            memory.look((time.monotonic() - began) / 60.0, processes, process.pid)
            for name, pid in processes.items():
                with suppress(OSError):
                    cpu[name] = cpu_s(pid)
    figures = json.loads((folder / "figures.json").read_text("utf-8"))
    (kept,) = (folder / "runs").iterdir()
    troubles = [f"it ended with exit code {process.returncode}"] if process.returncode else []
    troubles += [f"{name}: never seen" for name in _PROGRAMS.values() if name not in memory.growth]
    return SoakResult(
        minutes, time.monotonic() - began, cpu, memory, figures["dropped_periods"],
        periods_in(kept / "run.mcap"), figures["periods"], size_mb(kept / "run.mcap"),
        size_mb(kept / "run.rrd"), troubles,
    )  # fmt: skip


def _processes(run: int) -> dict[str, int]:
    """Return the processes of a run that goes on, by what they are."""
    found = {"run": run}
    with suppress(OSError):
        for pid in map(int, Path(f"/proc/{run}/task/{run}/children").read_text("ascii").split()):
            command = Path(f"/proc/{pid}/cmdline").read_bytes()
            found.update({name: pid for module, name in _PROGRAMS.items() if module.encode() in command})
    return found
