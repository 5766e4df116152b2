"""Sockets of this user's runs, one each, in a folder that only this user may use."""

from __future__ import annotations

import os
import socket
import struct
from contextlib import suppress
from pathlib import Path

from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.mailbox import MAILBOX_BYTES, Mailbox
from dcmp_hil.ipc.shared_memory import mapped
from dcmp_hil.platform.user_folder import private, temporary, usable

_CREDENTIALS_STRUCT = struct.Struct("3i")  # pid, uid, gid
_SOCKET_PATH_CHARS_MAX = 80  # characters: the path of a socket may have 107
_MAILBOX_NAME = "memfd:dcmp-hil mailbox"
_CONNECT_TIMEOUT_S = 0.5  # s to connect in


def folder() -> Path:
    """Return the folder of this user's sockets, made if need be.

    Raises
    ------
    ConfigError
        If it cannot be made, or is not this user's alone.
    """
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    try:
        place = (
            Path(base) / "dcmp-hil" if len(base) <= _SOCKET_PATH_CHARS_MAX and usable(base) else temporary()
        )
        if len(str(place)) > _SOCKET_PATH_CHARS_MAX:
            place = Path("/tmp") / place.name  # noqa: S108 - its owner and mode are checked
        return private(place)
    except OSError as error:
        where = error.filename or "no folder for temporary files"
        raise ConfigError(
            f"{where}: {error.strerror or error}. Set XDG_RUNTIME_DIR to a folder of your own."
        ) from None


def socket_of(pid: int) -> Path:
    """Return the path of the socket of the run in process `pid`."""
    return folder() / f"{pid}.sock"


def running() -> list[int]:
    """Return the process ids of the runs that listen, oldest first; what others left behind is removed."""
    return _runs()[0]


def unheard() -> list[int]:
    """Return the process ids of the runs that go on without their command process, oldest first."""
    return _runs()[1]


def _runs() -> tuple[list[int], list[int]]:
    """Return the runs that listen, and those whose socket has outlived the process that listened."""
    listening: list[tuple[float, int]] = []
    silent: list[tuple[float, int]] = []
    for path in folder().glob("*.sock"):
        if not path.stem.isdigit():
            continue
        pid = int(path.stem)
        heard = _alive(path)
        mailbox = None if heard else mailbox_of(pid)
        if not heard and mailbox is None:
            path.unlink(missing_ok=True)
        elif heard or (mailbox and not mailbox.ended):
            with suppress(OSError):
                (listening if heard else silent).append((path.stat().st_mtime, pid))
    return [pid for _, pid in sorted(listening)], [pid for _, pid in sorted(silent)]


def peer_of(connection: socket.socket) -> tuple[int, int]:
    """Return process and user id of the other end."""
    pid, uid, _ = _CREDENTIALS_STRUCT.unpack(
        connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS_STRUCT.size)
    )
    return pid, uid


def mailbox_of(pid: int) -> Mailbox | None:
    """Return the mailbox of a run by the descriptor that its process holds; None where it may not be seen."""
    with suppress(OSError):
        for link in Path(f"/proc/{pid}/fd").iterdir():
            if link.readlink().name.startswith(_MAILBOX_NAME):
                file = os.open(link, os.O_RDWR)
                try:
                    return Mailbox(mapped(file, MAILBOX_BYTES))
                finally:
                    os.close(file)
    return None


def _alive(path: Path) -> bool:
    """Whether a process listens there; no answer is waited for."""
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(_CONNECT_TIMEOUT_S)
        try:
            probe.connect(str(path))
        except (ConnectionRefusedError, FileNotFoundError):
            return False
        except OSError:  # a full queue: a process listens, if slowly
            return True
    return True
