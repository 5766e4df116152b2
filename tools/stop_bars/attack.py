"""Ask a run with a bad controller for STOP, and look at the device and at what is left."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.run_sockets import mailbox_of, running
from dcmp_hil.live.stop_command import STOP_TIME_MAX_S, is_alive
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.recording.reader import read_run
from tools.hosts import WAIT_TIMEOUT_S, wait
from tools.stop_bars.bars import SIGNALS, STUCK, ZERO_TIME_MAX_S, Bar
from tools.stop_bars.run import HostileRun, serve_panel

if TYPE_CHECKING:
    from collections import deque
    from collections.abc import Iterator

_ATTEMPTS_MAX = 10
_BUSY_ENDINGS = ("device_fault", "SampleTimeoutError", "DeadlineError")  # a busy computer ended it first


def attack(kind: str, way: str) -> Bar:
    """Start a run with a bad controller, ask for STOP, and look at the device and at what is left."""
    said = ""
    for _ in range(_ATTEMPTS_MAX):
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="stop", dir="/tmp")))
            host = HostileRun(kind, way, folder, stack)
            if not host.turned():
                said = host.log.read_text("utf-8", "replace")
                continue  # a busy computer: its device's watchdog was faster
            press = stack.enter_context(serve_panel(host.pid)) if way == "panel" else None
            bar = None if host.process.poll() is not None else _stop(host, kind, way, press)
            if bar is not None and bar.ended_by not in _BUSY_ENDINGS:
                return bar
    why = f"{_ATTEMPTS_MAX} runs ended before they were stopped, the last one: {said}"
    return Bar(kind, way, 0.0, 0.0, "", "", 0, (why,))


def _stop(host: HostileRun, kind: str, way: str, press: Any) -> Bar:
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
    exit_code = host.process.wait(WAIT_TIMEOUT_S)
    wrong = [*_late(zero_s, answer_s, said, way), *_wrong_answer(code, said, way), *_left(host, kind)]
    summary = _summary(host.folder)
    return Bar(kind, way, zero_s, answer_s, said, str(summary.get("ended_by")), exit_code, tuple(wrong))


def _ask(host: HostileRun, way: str, press: Any) -> tuple[str, int | None]:
    """Ask for STOP; return what was answered, and the exit code of what asked."""
    if way == "stop":
        done = subprocess.run(  # noqa: S603 - our own
            [sys.executable, "-m", "dcmp_hil", "stop", "--run", str(host.pid)],
            capture_output=True, text=True, timeout=WAIT_TIMEOUT_S, check=False,
        )  # fmt: skip
        return (done.stdout + done.stderr).strip(), done.returncode
    if way == "panel":
        return press(), None
    if way == "Ctrl-C":
        host.press_ctrl_c()
    elif way == "terminal":
        host.hang_up()
    else:
        host.process.send_signal(SIGNALS[way])
    return "", None


def _off_after(log: deque[Any], began_us: int) -> float:
    """Return the s from an instant of the firmware's clock to its first output at 0 V; 0 without one.

    The device is at 0 V by now. Without such an output it was so before that instant: its watchdog acted
    between the look at its output and the look at its clock.
    """
    off = next((output for output in tuple(log) if output.since_us >= began_us and not output.enable), None)
    return 0.0 if off is None else float(1e-6 * (off.since_us - began_us))


def _late(zero_s: float, answer_s: float, said: str, way: str) -> Iterator[str]:
    if zero_s > ZERO_TIME_MAX_S:
        yield f"0 V after {zero_s:.2f} s"
    after = re.search(r"after (\d+) ms", said)
    if after and int(after[1]) > 1e3 * STOP_TIME_MAX_S:
        yield f"told after {after[1]} ms"
    if way != "stop" and answer_s > STOP_TIME_MAX_S:  # a command takes its time to start
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


def _left(host: HostileRun, kind: str) -> Iterator[str]:
    """Yield what a run left: processes, sockets, files."""
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
    """Return the run's recording if it is complete."""
    for path in folder.glob("runs/*/run.mcap"):
        with suppress(ConfigError):
            found = read_run(path)
            return found if found.complete and len(found.rows) else None
    return None
