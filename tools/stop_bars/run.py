"""A real run with a bad controller at a device of its own, and the page of its panel."""

from __future__ import annotations

import http.cookiejar
import json
import os
import shutil
import socket
import subprocess
import sys
import urllib.request
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil import load_rig
from dcmp_hil.live.stop_command import is_alive
from dcmp_hil.platform.clock import MonotonicClock
from sim_backend.board.virtual_device import VirtualDevice
from tools.hosts import WAIT_TIMEOUT_S, wait
from tools.stop_bars.bars import HOSTILE

if TYPE_CHECKING:
    from collections.abc import Iterator

_ATTACK_TIME_S = 0.6  # device time after which a controller turns bad
_PORT_ATTEMPTS_MAX = 5
_RATE_HZ = 250  # a busy computer is late for fewer periods
_WATCHDOG_MS = 50  # of no matter here, and a busy computer is not to meet it


def _page(pid: int) -> tuple[subprocess.Popen[str], str]:
    """Start a page for a run; return its process and its address."""
    said = ""
    for _ in range(_PORT_ATTEMPTS_MAX):  # a port that is free now may be taken before the page binds it
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        page = subprocess.Popen(  # noqa: S603 - our own
            [sys.executable, "-m", "dcmp_hil", "panel", "--run", str(pid), "--port", str(port)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert page.stdout is not None  # noqa: S101 - it was asked for
        if line := page.stdout.readline():
            return page, line.split()[-1]
        said = page.communicate()[1]
    raise OSError(f"the page did not start: {said}")


@contextmanager
def serve_panel(pid: int) -> Iterator[Any]:
    """Serve a page for a run; yield what presses its STOP."""
    page, address = _page(pid)
    with page:
        try:
            origin = address.partition("/?")[0]
            opener = urllib.request.build_opener(
                urllib.request.HTTPCookieProcessor(http.cookiejar.CookieJar()),
                urllib.request.ProxyHandler({}),
            )
            opener.open(address, timeout=WAIT_TIMEOUT_S).close()

            def press(path: str = "stop") -> str:
                request = urllib.request.Request(  # noqa: S310 - 127.0.0.1
                    f"{origin}/{path}",
                    b'{"changes": []}',
                    {"Origin": origin, "Content-Type": "application/json"},
                )
                with opener.open(request, timeout=WAIT_TIMEOUT_S) as answer:
                    return str(json.load(answer)["said"])

            wait(lambda: "is no run" not in press("set") or not is_alive(pid), "the page found the run")
            yield press
        finally:
            page.kill()


class HostileRun:
    """A real run with a bad controller, against a device of its own."""

    def __init__(self, kind: str, way: str, folder: Path, stack: ExitStack) -> None:
        self.folder = folder
        rig = load_rig("bench-1khz", [f"loop.rate_hz={_RATE_HZ}"])
        self.device = stack.enter_context(VirtualDevice(rig, clock=MonotonicClock()))
        self.device.start()
        shutil.copy(HOSTILE, folder / "hostile.py")
        turns = round(_ATTACK_TIME_S * rig.loop.rate_hz)
        sets = [
            f"backend.port={self.device.port}", f"backend.watchdog_ms={_WATCHDOG_MS}",
            f"loop.rate_hz={_RATE_HZ}", "reference.soft_start_s=0.2", "supervisor.error_limit_rad=none",
            f"controller.kind=hostile:{kind}", f"controller.options={{turns = {turns}}}",
        ]  # fmt: skip
        command = [
            sys.executable,
            "-m",
            "dcmp_hil",
            "run",
            "bench-serial",
            "--viewer",
            "none",
            "--duration",
            "0",
        ]
        command += [part for one in sets for part in ("--set", one)]
        self._terminal, theirs = os.openpty()
        stack.callback(self._close_terminal)
        self.log = folder / "stderr"
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(  # noqa: S603 - our own
                [sys.executable, "-c", _IN_TERMINAL, *command] if way in {"Ctrl-C", "terminal"} else command,
                cwd=folder, stdin=theirs, stdout=subprocess.DEVNULL, stderr=log, start_new_session=True,
            )  # fmt: skip
        os.close(theirs)
        stack.callback(self._end)

    @property
    def pid(self) -> int:
        """Process id of the run."""
        return self.process.pid

    def turned(self) -> bool:
        """Wait until its controller has turned bad; False if the run ended before."""
        self._wait_or_end(lambda: self.device.output.state == _RUN_STATE)
        began = self.device.tick_count
        wanted = (_ATTACK_TIME_S + 0.4) * _RATE_HZ
        self._wait_or_end(lambda: self.device.tick_count - began > wanted)
        return self.process.poll() is None

    def driven(self) -> bool:
        """Return whether the device's amplifier is enabled."""
        return self.device.output.enable == 1

    def press_ctrl_c(self) -> None:
        """Press Ctrl-C in the run's terminal."""
        os.write(self._terminal, b"\x03")

    def hang_up(self) -> None:
        """Close the run's terminal."""
        self._close_terminal()

    def _wait_or_end(self, holds: Any) -> None:
        wait(lambda: holds() or self.process.poll() is not None, "the run got under way")

    def _close_terminal(self) -> None:
        if self._terminal >= 0:
            os.close(self._terminal)
            self._terminal = -1

    def _end(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(WAIT_TIMEOUT_S)


_RUN_STATE = 3
_IN_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.argv[1], sys.argv[1:])
"""
"""Makes the terminal at descriptor 0 that of the session, then becomes the run."""
