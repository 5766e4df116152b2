"""A child process of the tests, which answers as the telemetry process does, and imports nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dcmp_hil.ipc.child_process import ParentProcess


def main(parent: ParentProcess, _: int) -> None:
    """Answer to the start and to the end of the run."""
    parent.channel.send(b"up")
    while parent.channel.recv(1 << 16):
        pass
    parent.channel.send(b"figures")
    parent.channel.send(b"done")
