"""A Dask cluster as processes on 127.0.0.1: a scheduler, and workers that come and go."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from dcmp_hil.platform.clock import MonotonicClock, pause
from tests.installed import ROOT, environment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

START_S = 60.0  # that a process of Dask may take to start, on a busy machine
ALLOWED_FAILURES = 1  # workers that a block may cost: with the next it is given up
_HERE = ("--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0")


def wait_until(is_so: Callable[[], object], what: str, within: float = START_S) -> None:
    """Wait until something is so; fail in words if it does not become so in time (s)."""
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(within * 1e9)
    while not is_so():
        assert clock.now_ns() < end_ns, what
        pause(0.02)


class DaskProcesses:
    """A scheduler and its workers, each a process in a session of its own.

    Parameters
    ----------
    folder
        Where they run, and keep logs and what they store.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.workers: list[subprocess.Popen[bytes]] = []
        self._processes: list[subprocess.Popen[bytes]] = []
        self._taken = 0  # workers that were started
        self.address = ""

    def start(self) -> None:
        """Start the scheduler; it ends by itself after a while in which nothing asks it for anything."""
        contact = self.folder / "scheduler.json"
        options = ("--port", "0", "--scheduler-file", str(contact), "--idle-timeout", "300")
        self.scheduler = self._start("scheduler", *options)
        wait_until(lambda: contact.exists() and contact.read_text().endswith("}"), "no scheduler started")
        self.address = json.loads(contact.read_text())["address"]

    def have(self, count: int) -> None:
        """See that there are so many workers of one thread: start those that are missing."""
        self.workers = [worker for worker in self.workers if worker.poll() is None]
        while len(self.workers) < count:
            self.workers.append(
                self._start(
                    "worker", self.address, "--no-nanny", "--nthreads", "1", "--memory-limit", "0",
                    "--local-directory", str(self.folder), "--death-timeout", str(START_S),
                )
            )  # fmt: skip
        wait_until(lambda: self._registered() == self._taken, "no worker registered")

    def end(self) -> None:
        """End every process by its number, and wait for it."""
        for process in self._processes:
            process.kill()
            process.wait(START_S)

    def _registered(self) -> int:
        """Return how many workers the scheduler has taken, as its log says."""
        return (self.folder / "scheduler.log").read_text().count("Register worker")

    def _start(self, kind: str, *arguments: str) -> subprocess.Popen[bytes]:
        self._taken += kind == "worker"
        name = kind if kind == "scheduler" else f"{kind}-{self._taken}"
        settings = {
            "PYTHONPATH": str(ROOT),
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": str(ALLOWED_FAILURES),
        }
        with (self.folder / f"{name}.log").open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", kind, *_HERE, *arguments],
                cwd=self.folder, env=environment(**settings), stdin=subprocess.DEVNULL,
                stdout=log, stderr=log, start_new_session=True,
            )  # fmt: skip
        self._processes.append(process)
        return process


@contextmanager
def dask_processes(folder: Path) -> Iterator[DaskProcesses]:
    """Give a scheduler without workers; in the end all are gone."""
    folder.mkdir()
    processes = DaskProcesses(folder)
    try:
        processes.start()
        yield processes
    finally:
        processes.end()
