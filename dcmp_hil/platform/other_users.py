"""Other users of this computer at a port that serves a dashboard: Rerun's server admits every client."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

_SOCKET_TABLE = Path("/proc/net/tcp")
_DESCRIPTORS = Path("/proc/self/fd")
_CONNECTED_STATES = {"01", "04", "05", "08"}  # established, and on the way out with what was read
_PERSON_USER_IDS = range(1000, 60_000)  # user numbers, as distributions give them
_ROOT_USER_ID = 0  # may do as it likes, and reads this process's memory


def strangers(port: int) -> list[int]:
    """Return the users, this one and root left out, who are connected to a port of 127.0.0.1."""
    here = f"0100007F:{port:04X}"
    try:
        rows = [line.split() for line in _SOCKET_TABLE.read_text("ascii").splitlines()[1:]]
    except OSError:  # not Linux: it cannot be found out
        return []
    users = {int(row[7]) for row in rows if row[2] == here and row[3] in _CONNECTED_STATES}
    return sorted(users - {os.getuid(), _ROOT_USER_ID})


class StrangerWatch:
    """Other users at a port that this process serves, asked for often.

    The kernel's table of connections takes milliseconds to read. It is read when this process has a socket
    that it did not have at the last look: each connection that its server has accepted is one.

    Parameters
    ----------
    port
        Of 127.0.0.1.
    """

    def __init__(self, port: int) -> None:
        self._port = port
        self._known: set[int] = set()

    def look(self) -> list[int]:
        """Return the users, this one and root left out, of connections that are new since the last look."""
        known, self._known = self._known, _own_sockets()
        return strangers(self._port) if self._known - known else []


def _own_sockets() -> set[int]:
    """Return the sockets of this process, by numbers that the kernel gives to no other while they last."""
    found = set()
    with suppress(OSError), os.scandir(_DESCRIPTORS) as descriptors:  # where it is not Linux
        for descriptor in descriptors:
            with suppress(OSError):  # closed meanwhile
                status = os.fstat(int(descriptor.name))
                if stat.S_ISSOCK(status.st_mode):
                    found.add(status.st_ino)
    return found


def others_here() -> bool:
    """Return whether another person has a process on this computer."""
    with suppress(OSError):
        for place in Path("/proc").iterdir():
            if place.name.isdigit():
                with suppress(OSError):
                    user = place.stat().st_uid
                    if user in _PERSON_USER_IDS and user != os.getuid():
                        return True
    return False
