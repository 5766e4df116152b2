"""The native viewer as a process of its own, and the ports of this machine on the way to it."""

from __future__ import annotations

import os
import socket
import subprocess
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from dcmp_hil.platform import process_log
from dcmp_hil.platform.clock import MonotonicClock, pause
from dcmp_hil.platform.parent_death import tied

if TYPE_CHECKING:
    from collections.abc import Iterator

LOOPBACK = "127.0.0.1"
VIEWER_PORT, WEB_PORT = 9876, 9090
_PORT_ATTEMPTS_MAX = 50
_ANSWER_TIMEOUT_S = 3.0
"""Seconds that a server may take on a busy computer; a port without a listener refuses at once."""
_FETCH_TIMEOUT_S = 10.0
"""Seconds; a window takes a second or two to open, and a run in virtual time may be over by then."""
_CAUGHT_UP_CHECKS, _STUCK_CHECKS = 5, 10
"""Looks in a row, 0.1 s apart, with nothing left to send, or with as much as before."""
_CONNECTIONS = Path("/proc/net/tcp")
_ESTABLISHED, _LISTENING = "01", "0A"  # in there
_HTTP2_PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + bytes(
    (0, 0, 0, 4, 0, 0, 0, 0, 0)
)  # with empty settings
_HTTP2_SETTINGS_TYPE = b"\x04"  # type of the frame that every HTTP/2 server answers with
_WEB_LOOK = "theme=dark&hide_welcome_screen=1"
_CLOSED_PORT_URL = "http://127.0.0.1:9"  # the port that discards; no server listens there
_OFFLINE_ENVIRONMENT = {
    "CI": "1",
    "RERUN_ANALYTICS": "0",
    "HTTPS_PROXY": _CLOSED_PORT_URL,
    "https_proxy": _CLOSED_PORT_URL,
}
"""The viewer asks no server: neither for analytics nor, which has no switch, for a newer version."""


def proxy_url(port: int) -> str:
    """Return the address under which a viewer finds a recording served on this machine."""
    return f"rerun+http://{LOOPBACK}:{port}/proxy"


def free_ports(first: int) -> Iterator[int]:
    """Yield the ports from `first` on that are free at the moment when each is asked for."""
    for port in range(first, first + _PORT_ATTEMPTS_MAX):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does
            try:
                probe.bind((LOOPBACK, port))
            except OSError:
                continue
        yield port


def free_port(first: int = VIEWER_PORT) -> int | None:
    """Return the first port from `first` on without a listener; None if there is none near."""
    return next(free_ports(first), None)


def serves(port: int, pid: int, within: float) -> bool:
    """Return whether process `pid` came to listen on `port`; False as soon as another one does.

    Between the look for a free port and its use another process may take it, and then answers in its place.

    Parameters
    ----------
    port
        On 127.0.0.1.
    pid
        A process of this user.
    within
        s, the longest that a server takes to start.
    """
    if not _CONNECTIONS.exists():  # not Linux: its owner cannot be found
        return answers(port, within)
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(within * 1e9)
    while True:
        listening = _listening(port)
        if listening or clock.now_ns() >= end_ns or not _alive(pid):
            return bool(listening & _sockets_of(pid))
        pause(0.02)


def _listening(port: int) -> set[str]:
    """Return the sockets that listen on `port` of 127.0.0.1 or of every address, as /proc names them."""
    rows = [line.split() for line in _CONNECTIONS.read_text(encoding="ascii").splitlines()[1:]]
    ours = {f"{address}:{port:04X}" for address in ("0100007F", "00000000")}
    return {f"socket:[{row[9]}]" for row in rows if row[3] == _LISTENING and row[1] in ours}


def _sockets_of(pid: int) -> set[str]:
    found = set()
    with suppress(OSError):
        for entry in Path(f"/proc/{pid}/fd").iterdir():
            with suppress(OSError):
                found.add(str(entry.readlink()))
    return found


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def answers(port: int, within: float) -> bool:
    """Return whether a server accepts connections on `port` within so many seconds."""
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(within * 1e9)
    while True:
        try:
            socket.create_connection((LOOPBACK, port), timeout=within).close()
        except OSError:
            if clock.now_ns() >= end_ns:
                return False
            pause(0.02)
        else:
            return True


def speaks_http2(port: int, within: float = _ANSWER_TIMEOUT_S) -> bool:
    """Return whether a server answers on `port`, as a viewer does; a frozen one only accepts."""
    try:
        with socket.create_connection((LOOPBACK, port), timeout=within) as connection:
            connection.sendall(_HTTP2_PREFACE)
            header = connection.recv(9)
    except OSError:
        return False
    return header[3:4] == _HTTP2_SETTINGS_TYPE


def viewer_binary() -> Path:
    """Return the viewer's own binary: the command `rerun` is a Python process around it."""
    package = find_spec("rerun_cli")
    if package is None or package.origin is None:
        raise FileNotFoundError("the package rerun_cli is missing: install rerun-sdk again")
    return Path(package.origin).with_name("rerun")


def viewer_environment() -> dict[str, str]:
    """Return this environment, changed so that a viewer makes no request to the Internet."""
    return {**os.environ, **_OFFLINE_ENVIRONMENT}


def start_viewer(port: int) -> subprocess.Popen[bytes]:
    """Open a window on the recording served on `port`; it outlives this process.

    The port must answer already: a viewer that finds no server does not try again.

    Raises
    ------
    OSError
        If the viewer cannot be started.
    """
    options = ["--bind", LOOPBACK, "--memory-limit", "2GB", "--connect", proxy_url(port)]
    return subprocess.Popen(  # noqa: S603 - the binary of our own dependency
        [viewer_binary(), *options],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=process_log.for_programs(),
        env=viewer_environment(),
        start_new_session=True,  # Ctrl-C ends the run, not the window
    )


def web_url(web_port: int, port: int) -> str:
    """Return the page on which the web viewer shows what is served on `port`.

    Dark, as the colours of the dashboard are meant, also in a browser that is set to light; and without the
    page that greets until data are there.
    """
    return f"http://{LOOPBACK}:{web_port}?url={quote(proxy_url(port), safe='')}&{_WEB_LOOK}"


def start_web_viewer(web_port: int, port: int) -> subprocess.Popen[bytes]:
    """Serve the web viewer's pages on `web_port` until this process or that one ends; they show `port`.

    Raises
    ------
    OSError
        If it cannot be started.
    """
    options = ["--serve-web", "--bind", LOOPBACK, "--web-viewer-port", str(web_port), proxy_url(port)]
    return subprocess.Popen(  # noqa: S603 - the binary of our own dependency
        tied([str(viewer_binary()), *options]),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=process_log.for_programs(),
        env=viewer_environment(),
        start_new_session=True,  # Ctrl-C ends the run, which ends this
    )


def served(first: int = VIEWER_PORT) -> list[int]:
    """Return the ports on which a recording is served, among those that a run would take."""
    return [port for port in range(first, first + _PORT_ATTEMPTS_MAX) if speaks_http2(port)]


def let_viewers_catch_up(port: int, opening: subprocess.Popen[bytes] | None = None) -> None:
    """Wait until viewers have fetched what is served on `port`: 10 s at most, 1 s for one that takes nothing.

    Parameters
    ----------
    port
        On 127.0.0.1.
    opening
        A viewer that is waited for until it is connected, or ends. Without one, and without a connection,
        there is nothing to wait for.
    """
    if not _CONNECTIONS.exists():  # not Linux: it cannot be found out
        return
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(_FETCH_TIMEOUT_S * 1e9)
    quiet = stuck = 0
    before: list[int] = []
    while quiet < _CAUGHT_UP_CHECKS and stuck < _STUCK_CHECKS and clock.now_ns() < end_ns:
        unsent = _unsent(port)
        if not unsent and (opening is None or opening.poll() is not None):
            return
        quiet = quiet + 1 if unsent and not any(unsent) else 0
        stuck = stuck + 1 if any(unsent) and unsent == before else 0
        before = unsent
        pause(0.1)


def _unsent(port: int) -> list[int]:
    """Return the bytes that wait in each connection to `port`, as the kernel counts them."""
    lines = _CONNECTIONS.read_text(encoding="ascii").splitlines()[1:]
    connections = [line.split() for line in lines]
    return [
        int(queues.partition(":")[0], 16)
        for _, local, _, state, queues, *_ in connections
        if state == _ESTABLISHED and int(local.rpartition(":")[2], 16) == port
    ]
