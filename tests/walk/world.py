"""What commands need around them, made when asked for: a recording, a device, a run that goes on."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import tempfile
import time
from contextlib import ExitStack, contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from tests.installed import environment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_TIMEOUT_S = 300.0  # s: a computer may be busy
_RUN = ("run", "--no-record", "--duration", "0", "--set", "supervisor.monitors=finite")


class World:
    """Makes what the names in braces of a row stand for.

    Parameters
    ----------
    script
        `dcmp-hil` of an installed wheel.
    folder
        Empty, and this object's own.
    runtime
        Where runs listen: a short path, of this object alone.
    """

    def __init__(self, script: Path, folder: Path, runtime: Path) -> None:
        self._script, self._folder = script, folder
        self.env: dict[str, str | None] = {"XDG_RUNTIME_DIR": str(runtime)}
        self.stack = ExitStack()

    def names(self, words: tuple[str, ...], folder: Path) -> dict[str, str]:
        """Return the names in braces that `words` have, with what they stand for."""
        asked = set(re.findall(r"\{(\w+)\}", " ".join(words)))
        return {name: str(folder) if name == "folder" else str(getattr(self, name)) for name in asked}

    @cached_property
    def rig(self) -> Path:
        """A rig file of the user's own."""
        self._call("rigs", "--copy", "bench-1khz", "own.toml")
        return self._folder / "own.toml"

    @cached_property
    def sweep(self) -> Path:
        """The file of a sweep of two short runs."""
        place = self._folder / "two.toml"
        place.write_text('rig = "bench-1khz"\nduration_s = 0.6\nruns = 2\n', "utf-8")
        return place

    @cached_property
    def recording(self) -> Path:
        """A run's own recording."""
        self._call("run", "--fast", "--duration", "1", "--viewer", "none")
        (run,) = (self._folder / "runs").iterdir()
        return run / "run.mcap"

    @cached_property
    def csv(self) -> Path:
        """A recording as a logger writes it: time, position, torque, voltage, velocity."""
        self._call("export", str(self.recording), "--csv", "all.csv")
        lines = [line.split(",") for line in (self._folder / "all.csv").read_text().splitlines()]
        # The voltage stands for the torque as well: what it says is not judged here.
        columns = ("time_s", "position_rad", "voltage_sent_V", "voltage_sent_V", "velocity_estimate_rad_s")
        places = [lines[0].index(name) for name in columns]
        rows = ["t,q,tau,u,v", *(",".join(line[k] for k in places) for line in lines[1:])]
        path = self._folder / "recording.csv"
        path.write_text("\n".join(rows) + "\n")
        return path

    @cached_property
    def device(self) -> Path:
        """The port of a virtual device."""
        port = self._folder / "device"
        self.stack.enter_context(self._going_on("device", "--symlink", str(port)))
        self._until(port.exists, "the device's port")
        return port

    @cached_property
    def pid(self) -> int:
        """Return the process id of a run that accepts clients."""
        return self.stack.enter_context(self.run())

    @cached_property
    def served(self) -> int:
        """The port on which a run is served."""
        said = self._folder / "served"
        self.stack.enter_context(self._going_on(*_RUN, "--no-control", "--viewer", "serve", said=said))
        self._until(lambda: "proxy" in said.read_text(), "the run's address")
        (port,) = re.findall(r":(\d+)/proxy", said.read_text())
        return int(port)

    @property
    def port(self) -> int:
        """Return a free port of 127.0.0.1."""
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            return int(probe.getsockname()[1])

    @contextmanager
    def alone(self) -> Iterator[World]:
        """Yield a world in which no other run listens."""
        with tempfile.TemporaryDirectory(prefix="dcmp", dir="/tmp") as runtime:
            yield World(self._script, self._folder, Path(runtime))

    @contextmanager
    def run(self) -> Iterator[int]:
        """Yield the process id of a run that goes on until then."""
        listens = Path(str(self.env["XDG_RUNTIME_DIR"])) / "dcmp-hil"
        with self._going_on(*_RUN, "--viewer", "none") as pid:
            self._until(lambda: self._status(pid), f"the run in {listens}")
            yield pid

    def _status(self, pid: int) -> bool:
        done = subprocess.run(
            [self._script, "status", "--run", str(pid)],
            env=environment(**self.env),
            capture_output=True,
            text=True,
            timeout=_TIMEOUT_S,
            check=False,
        )
        return "running" in done.stdout

    @contextmanager
    def _going_on(self, *arguments: str, said: Path | None = None) -> Iterator[int]:
        path = said or Path(os.devnull)
        with (
            path.open("w") as file,
            subprocess.Popen(
                [self._script, *arguments],
                cwd=self._folder,
                env=environment(**self.env),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=file,
            ) as process,
        ):
            try:
                yield process.pid
            finally:
                process.send_signal(signal.SIGINT)
                with suppress(subprocess.TimeoutExpired):
                    process.wait(30.0)
                process.kill()

    def _call(self, *arguments: str) -> None:
        subprocess.run(
            [self._script, *arguments],
            cwd=self._folder,
            env=environment(**self.env),
            capture_output=True,
            timeout=_TIMEOUT_S,
            check=True,
        )

    def _until(self, done: Callable[[], object], what: str) -> None:
        end = time.monotonic() + _TIMEOUT_S
        while not done():
            assert time.monotonic() < end, f"never: {what}"
            time.sleep(0.1)
