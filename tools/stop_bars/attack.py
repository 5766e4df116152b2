"""`python -m tools.stop_bars`: STOP against controllers that are bad to their run, at a device's truth."""

from __future__ import annotations

import argparse
import http.cookiejar
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from dcmp_hil import load_rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.live.places import mailbox_of, running
from dcmp_hil.live.stopping import LIMIT, is_alive
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.recording.reader import read_run
from sim_backend.board.virtual_device import VirtualDevice
from tools.hosts import BOUND_S, wait

if TYPE_CHECKING:
    from collections import deque
    from collections.abc import Iterator, Sequence

HOSTILE = Path(__file__).parents[1] / "tests/attacks/hostile/controllers.py"
ZERO_S = 1.1
"""s, from STOP until the device is at 0 V."""
_TURNS_S = 0.6  # device time after which a controller turns bad
_TRIES = 10
_RATE_HZ = 250  # a busy computer is late for fewer periods
_BUSY = ("device_fault", "SampleTimeoutError", "DeadlineError")  # a computer that is busy ended it first
_WATCHDOG_MS = 50  # of no matter here, and a busy computer is not to meet it
_SIGNALS = {"SIGINT": signal.SIGINT, "SIGTERM": signal.SIGTERM, "SIGHUP": signal.SIGHUP}
WAYS = ("stop", "panel", "Ctrl-C", "terminal", *_SIGNALS)
"""`dcmp-hil stop`; the page's STOP; Ctrl-C in a terminal; a closed terminal; a signal to the run alone."""
STUCK = ("SwallowsForEver", "BlocksInC", "Sleeps", "BusyLoop", "BusyLoopDeaf", "ForksThenBlocks")
"""Their loop stands still once they have turned bad."""
KINDS = (
    *("Good", "HandlersSet", "HandlersSetEachPeriod", "SignalsIgnored", "SignalsIgnoredInC"),
    *("SignalsBlocked", "Swallows", "Forks", "Worker", "Threads"),
    *STUCK,
)
REQUIRED = ("HandlersSet", "SignalsIgnored", "Swallows", "Forks", "BlocksInC", "BusyLoop")


class Bar(NamedTuple):
    """What one STOP came to."""

    kind: str
    way: str
    zero_s: float  # from STOP to 0 V, by the firmware's clock
    answer_s: float  # from STOP to its answer, by wall; to the run's last words, or its end, after a signal
    said: str  # the answer, where there is one
    ended_by: str  # of summary.json
    exit_code: int  # of the run
    wrong: tuple[str, ...]  # what is not as it must be


@contextmanager
def _panel(pid: int) -> Iterator[Any]:
    """Serve a page for a run; yield what presses its STOP."""
    with subprocess.Popen(  # noqa: S603 - our own
        [sys.executable, "-m", "dcmp_hil", "panel", "--run", str(pid), "--port", str(20_000 + pid % 40_000)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as page:
        try:
            assert page.stdout is not None  # noqa: S101 - it was asked for
            address = page.stdout.readline().split()[-1]
            origin = address.partition("/?")[0]
            opener = urllib.request.build_opener(
                urllib.request.HTTPCookieProcessor(http.cookiejar.CookieJar()),
                urllib.request.ProxyHandler({}),
            )
            opener.open(address, timeout=BOUND_S).close()

            def press(path: str = "stop") -> str:
                request = urllib.request.Request(  # noqa: S310 - 127.0.0.1
                    f"{origin}/{path}",
                    b'{"changes": []}',
                    {"Origin": origin, "Content-Type": "application/json"},
                )
                with opener.open(request, timeout=BOUND_S) as answer:
                    return str(json.load(answer)["said"])

            wait(lambda: "is no run" not in press("set") or not is_alive(pid), "the page found the run")
            yield press
        finally:
            page.kill()


class _Host:
    """A real run with a bad controller, against a device of its own."""

    def __init__(self, kind: str, way: str, folder: Path, stack: ExitStack) -> None:
        self.folder = folder
        rig = load_rig("bench-1khz", [f"loop.rate_hz={_RATE_HZ}"])
        self.device = stack.enter_context(VirtualDevice(rig, clock=MonotonicClock()))
        self.device.start()
        shutil.copy(HOSTILE, folder / "hostile.py")
        turns = round(_TURNS_S * rig.loop.rate_hz)
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
        return self.process.pid

    def turned(self) -> bool:
        """Wait until its controller has turned bad; False if the run ended before."""
        self._wait_or_end(lambda: self.device.output.state == _RUN)
        began = self.device.tick_count
        wanted = (_TURNS_S + 0.4) * _RATE_HZ
        self._wait_or_end(lambda: self.device.tick_count - began > wanted)
        return self.process.poll() is None

    def driven(self) -> bool:
        return self.device.output.enable == 1

    def press_ctrl_c(self) -> None:
        os.write(self._terminal, b"\x03")

    def hang_up(self) -> None:
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
        self.process.wait(BOUND_S)


_RUN = 3
_IN_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.argv[1], sys.argv[1:])
"""
"""Makes the terminal at descriptor 0 that of the session, then becomes the run."""


def attack(kind: str, way: str) -> Bar:
    """Start a run with a bad controller, ask for STOP, and look at the device and at what is left."""
    said = ""
    for _ in range(_TRIES):
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="stop", dir="/tmp")))
            host = _Host(kind, way, folder, stack)
            if not host.turned():
                said = host.log.read_text("utf-8", "replace")
                continue  # a busy computer: its device's watchdog was faster
            press = stack.enter_context(_panel(host.pid)) if way == "panel" else None
            bar = None if host.process.poll() is not None else _stop(host, kind, way, press)
            if bar is not None and bar.ended_by not in _BUSY:
                return bar
    why = f"{_TRIES} runs ended before they were stopped, the last one: {said}"
    return Bar(kind, way, 0.0, 0.0, "", "", 0, (why,))


def _stop(host: _Host, kind: str, way: str, press: Any) -> Bar:
    clock, device = MonotonicClock(), host.device
    mailbox = mailbox_of(host.pid)
    was_off = None if host.driven() else 0.0  # its watchdog has acted long ago
    began_ns, (began_us, _) = clock.now_ns(), device.clock_us()
    with ThreadPoolExecutor(1) as pool:
        answer = pool.submit(_ask, host, way, press)
        wait(lambda: not host.driven(), "the device is at 0 V")
        zero_s = was_off if was_off is not None else _off_after(device.log, began_us)
        if press is None and way != "stop":
            ended = lambda: mailbox is None or mailbox.ended or not is_alive(host.pid)  # noqa: E731
            wait(ended, "the run has ended")
        said, code = answer.result()
        answer_s = 1e-9 * (clock.now_ns() - began_ns)
    exit_code = host.process.wait(BOUND_S)
    wrong = [*_late(zero_s, answer_s, said, way), *_wrong_answer(code, said, way), *_left(host, kind)]
    summary = _summary(host.folder)
    return Bar(kind, way, zero_s, answer_s, said, str(summary.get("ended_by")), exit_code, tuple(wrong))


def _ask(host: _Host, way: str, press: Any) -> tuple[str, int | None]:
    """Ask for STOP; return what was answered, and the exit code of what asked."""
    if way == "stop":
        done = subprocess.run(  # noqa: S603 - our own
            [sys.executable, "-m", "dcmp_hil", "stop", "--run", str(host.pid)],
            capture_output=True, text=True, timeout=BOUND_S, check=False,
        )  # fmt: skip
        return (done.stdout + done.stderr).strip(), done.returncode
    if way == "panel":
        return press(), None
    if way == "Ctrl-C":
        host.press_ctrl_c()
    elif way == "terminal":
        host.hang_up()
    else:
        host.process.send_signal(_SIGNALS[way])
    return "", None


def _off_after(log: deque[Any], began_us: int) -> float:
    """Return the s from an instant of the firmware's clock to the first output at 0 V after it."""
    off = next(output for output in tuple(log) if output.since_us >= began_us and not output.enable)
    return float(1e-6 * (off.since_us - began_us))


def _late(zero_s: float, answer_s: float, said: str, way: str) -> Iterator[str]:
    if zero_s > ZERO_S:
        yield f"0 V after {zero_s:.2f} s"
    after = re.search(r"after (\d+) ms", said)
    if after and int(after[1]) > 1e3 * LIMIT:
        yield f"told after {after[1]} ms"
    if way != "stop" and answer_s > LIMIT:  # a command takes its time to start
        yield f"told after {answer_s:.2f} s"


def _wrong_answer(code: int | None, said: str, way: str) -> Iterator[str]:
    if way not in {"stop", "panel"}:
        return
    confirmed = "confirmed after" in said
    forced = "did not answer" in said
    if not (confirmed or forced):
        yield f"the answer is: {said}"
    if code is not None and code != (0 if confirmed else 7):
        yield f"exit code {code}: {said}"


def _left(host: _Host, kind: str) -> Iterator[str]:
    """Look at what is left: processes, sockets, files."""
    try:
        wait(lambda: _summary(host.folder) and host.pid not in running(), "its files", within_s=15.0)
    except TimeoutError as error:
        yield str(error)
    try:
        with suppress(StopIteration):
            wait(lambda: _recording(host.folder) is not None, "its recording is complete", within_s=15.0)
    except TimeoutError as error:
        yield str(error)
    said = host.log.read_text("utf-8", "replace")
    if "Traceback" in said:
        yield f"a traceback: {said.splitlines()[-1]}"
    if kind in STUCK and not said.strip():
        yield "nothing was said"


def _summary(folder: Path) -> dict[str, Any]:
    for path in folder.glob("runs/*/summary.json"):
        with suppress(ValueError):
            return dict(json.loads(path.read_text("utf-8")))
    return {}


def _recording(folder: Path) -> object:
    """Return the run's recording, if it is whole."""
    for path in folder.glob("runs/*/run.mcap"):
        with suppress(ConfigError):
            found = read_run(path)
            return found if found.complete and len(found.rows) else None
    return None


def table(bars: Sequence[Bar]) -> str:
    """Return the figures as Markdown."""
    head = (
        "| controller | way | n | 0 V after, ms: median | max | told after, ms: median | max "
        "| ended by | code | wrong |"
    )
    rows = [head, re.sub("[^|]+", "---", head)]
    for kind, way in sorted({(bar.kind, bar.way) for bar in bars}):
        these = [bar for bar in bars if (bar.kind, bar.way) == (kind, way)]
        zero, told = [1e3 * bar.zero_s for bar in these], [1e3 * bar.answer_s for bar in these]
        cells = (
            kind, way, len(these), f"{statistics.median(zero):.0f}", f"{max(zero):.0f}",
            f"{statistics.median(told):.0f}", f"{max(told):.0f}",
            ", ".join(sorted({bar.ended_by for bar in these})),
            ", ".join(sorted({str(bar.exit_code) for bar in these})), sum(bool(bar.wrong) for bar in these),
        )  # fmt: skip
        rows.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(rows)


def main() -> int:
    """Attack, print; 1 if a bound was broken."""
    parser = argparse.ArgumentParser(prog="python -m tools.stop_bars", description=__doc__)
    parser.add_argument("--n", type=int, default=100, help="STOPs for each kind of controller (default: 100)")
    parser.add_argument("--kind", action="append", choices=KINDS, help="only this one; may be repeated")
    parser.add_argument("--way", action="append", choices=WAYS, help="only this one; may be repeated")
    parser.add_argument("--required", action="store_true", help="only the six kinds that CI asks for")
    parser.add_argument("--jobs", type=int, default=1, help="at a time (default: 1)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="where the table goes as well")
    asked = parser.parse_args()
    ways = asked.way or WAYS
    kinds = asked.kind or (REQUIRED if asked.required else KINDS)
    jobs = [(kind, ways[k % len(ways)]) for kind in kinds for k in range(asked.n)]
    with ThreadPoolExecutor(asked.jobs) as pool:
        bars = []
        for bar in pool.map(lambda job: attack(*job), jobs):
            bars.append(bar)
            sys.stderr.write(
                f"{len(bars)}/{len(jobs)} {bar.kind}, {bar.way}: {'; '.join(bar.wrong) or 'well'}\n"
            )
    said = table(bars) + "\n"
    wrong = [f"{bar.kind}, {bar.way}: {'; '.join(bar.wrong)}\n" for bar in bars if bar.wrong]
    sys.stdout.write(said + "".join(wrong))
    if asked.markdown:
        asked.markdown.write_text(said, encoding="utf-8")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
