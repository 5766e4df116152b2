"""`python -m tools.qemu_device`: the qemu_f405 board in QEMU, in the place of the native board's program.

Takes the native board's arguments and one more, `--elf`: the host is behind a pseudo terminal whose path is
the first line printed, the plant at the plant port. `VirtualDevice(program=...)` runs it.
"""

from __future__ import annotations

import argparse
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import tempfile
import tty
from pathlib import Path
from typing import TYPE_CHECKING

from sim_backend.board.plant_port import OUTPUT
from tools.record import RECORD_ADDRESS, RecordLink, image, record

if TYPE_CHECKING:
    from collections.abc import Callable

QEMU, INSTALL = "qemu-system-arm", "apt install --no-install-recommends qemu-system-arm"
_CHUNK_BYTES_MAX = 4096
_END_TIMEOUT_S = 2.0
_EMULATOR_FAILED_EXIT_CODE = 3


def command(elf: Path, record_file: Path, host_fd: int, plant_fd: int) -> list[str]:
    """Return what starts the emulator, with host and plant behind descriptors."""
    return [
        QEMU, "-machine", "netduinoplus2", "-nodefaults", "-nographic", "-kernel", str(elf),
        "-device", f"loader,file={record_file},addr={RECORD_ADDRESS:#x},force-raw=on",
        "-chardev", f"socket,id=host,fd={host_fd}", "-serial", "chardev:host",
        "-chardev", f"socket,id=plant,fd={plant_fd}", "-serial", "chardev:plant",
    ]  # fmt: skip


class Outlet:
    """A destination of bytes: without room at the reader, all but a begun piece is lost."""

    def __init__(self, end: int) -> None:
        self._end, self._rest = end, b""
        os.set_blocking(end, False)

    def write(self, data: bytes) -> None:
        """Write all of it, or as much as there is room for and the rest later, or nothing."""
        if self._put(self._rest) and data:
            self._put(data)

    def _put(self, data: bytes) -> bool:
        try:
            written = os.write(self._end, data) if data else 0
        except BlockingIOError:
            written = 0
        begun = written or data is self._rest
        self._rest = data[written:] if begun else b""
        return not self._rest


def carry(terminal: int, board_host: socket.socket, plant: socket.socket, board_plant: socket.socket) -> None:
    """Carry bytes between the terminal and the board, the plant and the board, until one of them has gone."""
    ways: dict[int, Callable[[bytes], object]] = {
        terminal: board_host.sendall, board_host.fileno(): Outlet(terminal).write,
        plant.fileno(): board_plant.sendall, board_plant.fileno(): plant.sendall,
    }  # fmt: skip
    poll = select.poll()
    for end in ways:
        poll.register(end, select.POLLIN)
    while True:
        for end, _ in poll.poll():
            data = os.read(end, _CHUNK_BYTES_MAX)
            if not data:
                return
            ways[end](data)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.qemu_device", description=__doc__)
    parser.add_argument("--elf", type=Path, required=True)
    parser.add_argument("--link", choices=("cobs", "slcan"), default="cobs")
    parser.add_argument("--plant-fd", type=int, required=True)
    parser.add_argument("fields", nargs="*", metavar="field=value")
    return parser.parse_args()


def main() -> int:
    """Run the emulator until the plant hangs up."""
    asked = _arguments()
    config = {name: int(value) for name, value in (field.split("=", 1) for field in asked.fields)}
    plant = socket.socket(fileno=asked.plant_fd)
    (board_host, host_end), (board_plant, plant_end) = socket.socketpair(), socket.socketpair()
    master, slave = pty.openpty()  # the other end stays open: a UART does not see whether it is connected
    tty.setraw(slave)
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "record.bin"
        kept.write_bytes(image(record(config, link=RecordLink[asked.link])))
        started = command(asked.elf, kept, host_end.fileno(), plant_end.fileno())
        try:
            emulator = subprocess.Popen(  # noqa: S603 - ours
                started, stdin=subprocess.DEVNULL, pass_fds=[host_end.fileno(), plant_end.fileno()]
            )
        except OSError as error:
            sys.stderr.write(f"{QEMU}: {error.strerror}. {INSTALL}\n")
            return _EMULATOR_FAILED_EXIT_CODE
        host_end.close()
        plant_end.close()
        signal.signal(signal.SIGTERM, lambda *_: emulator.kill())
        try:
            board_plant.recv(
                OUTPUT.size, socket.MSG_WAITALL
            )  # it has booted; ticks before that would be lost
            sys.stdout.write(f"{os.ttyname(slave)}\n")
            sys.stdout.flush()
            carry(master, board_host, plant, board_plant)
        finally:
            emulator.kill()
            emulator.wait(_END_TIMEOUT_S)
    return 0


if __name__ == "__main__":
    sys.exit(main())
