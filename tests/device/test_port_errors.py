"""What the operating system says of a port, in words."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import termios

import pytest

from dcmp_hil.device.links.port_errors import cannot_open, holder


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOENT, "gone"), ["no such port", "dcmp-hil ports"]),
        (OSError(errno.ENODEV, "gone"), ["no such port"]),
        (PermissionError(errno.EACCES, "no"), ["usermod -aG dialout"]),
        (OSError(errno.EBUSY, "busy"), ["busy", "End that first"]),
        (OSError(errno.EAGAIN, "locked"), ["busy"]),
        (OSError(errno.ENOTTY, "no tty"), ["no serial port"]),
        (termios.error(errno.ENOTTY, "no tty"), ["no serial port"]),
        (ValueError("odd"), ["cannot be opened", "odd"]),
    ],
)
def test_cannot_open_names_cause_and_remedy_on_one_line(error: BaseException, words: list[str]) -> None:
    text = str(cannot_open("/dev/ttyX", error))
    assert text.startswith("/dev/ttyX: ")
    assert "\n" not in text
    for word in words:
        assert word in text


def test_holder_names_the_other_process() -> None:
    master, slave = os.openpty()
    path = os.ttyname(slave)
    script = f"import os, sys; os.open({path!r}, os.O_RDWR); print(1, flush=True); sys.stdin.read()"
    other = subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, close_fds=True
    )
    try:
        assert other.stdout is not None
        other.stdout.readline()
        assert f"process {other.pid}" in holder(path)
    finally:
        other.communicate(timeout=10)
        os.close(master)
        os.close(slave)


def test_holder_is_empty_when_no_other_process_has_it_or_it_is_not_there() -> None:
    master, slave = os.openpty()
    assert holder(os.ttyname(slave)) == ""
    os.close(master)
    os.close(slave)
    assert holder("/dev/there-is-no-such-port") == ""
