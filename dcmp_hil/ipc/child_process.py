"""Answers of a child process: waited for as long as it works, and what is known where none comes."""

from __future__ import annotations

import signal
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    import socket

MESSAGE_BYTES_MAX = 1 << 16
"""Bytes of the longest."""
_WORK_TIMEOUT_S = 60.0  # s that a process has which works at its answer


def receive(channel: socket.socket, within: float) -> bytes:
    """Return the next message; nothing if there is none in time, or never will be."""
    channel.settimeout(max(within, 1e-3))
    try:
        return channel.recv(MESSAGE_BYTES_MAX)
    except OSError:
        return b""
    finally:
        channel.setblocking(False)  # a socket with a timeout waits even where it is told not to


def receive_from_working(process: subprocess.Popen[bytes], channel: socket.socket, idle: float) -> bytes:
    """Return the next message; nothing once the process has done nothing for `idle` (s), or has ended."""
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(_WORK_TIMEOUT_S * 1e9)
    used = _cpu_time(process.pid)
    while not (answer := receive(channel, idle)) and clock.now_ns() < end_ns:
        before, used = used, _cpu_time(process.pid)
        if used is None or used == before:
            return b""
    return answer


def _cpu_time(pid: int) -> int | None:
    """Return the clock ticks that a process has used, as the kernel counts them; None if it has ended."""
    try:
        state, *fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    except OSError:
        return None
    return None if state == "Z" else int(fields[10]) + int(fields[11])


def end_process(process: subprocess.Popen[bytes], within: float) -> int:
    """Wait for a process so many seconds, then kill it; return how it ended."""
    with suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
        return process.wait(within)
    process.kill()
    return process.wait()


def how_it_ended(code: int) -> str:
    """Return in words how a process ended."""
    if code == 0:
        return "left"
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"failed (exit code {code})"
