"""A child process of the tests, which shows what it was given."""

from __future__ import annotations

import os
import signal
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil.ipc.child_process import ParentProcess


def main(parent: ParentProcess, *files: int) -> None:
    """Answer with the set-up, the contents of the files and the blocked signals; then wait for the end."""
    blocked = [signal.Signals(number).name for number in signal.pthread_sigmask(signal.SIG_BLOCK, ())]
    contents = [os.pread(file, 100, 0).decode() for file in files]
    parent.channel.send(repr((parent.setup, contents, blocked)).encode())
    while parent.channel.recv(100):
        pass
