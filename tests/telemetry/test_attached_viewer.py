"""A viewer that is attached when a run ends has all of it, although the run's process is gone by then."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.marks import MARKS
from tests.live.processes import until
from tests.telemetry.pixels import coloured
from tools.screenshot import draw, headless_viewer, wait_until_loaded

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rerun.experimental import ViewerClient

_FIRST_PORT = 26_500  # of the ports; no other test serves there
_TIMEOUT_S = 60.0  # s: generous, these machines are shared
_MARKS_PIXELS_MIN = 300
_RUN = f"""
import os, sys
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.values import CauseData, Event, EventKind
from tests.telemetry.runs import VIEW, blocks
sink = RerunSink(VIEW, None, "serve", port={_FIRST_PORT})
*first, last = blocks(20_000)
for block in first:
    sink.block(block)
print(sink.port, flush=True)
sys.stdin.readline()
sink.block(last)
t = float(last["t"][-1])
sink.event(Event(t, "ERROR", EventKind.TRIP, "tripped (travel): too far", CauseData("travel")))
sink.event(Event(t, "INFO", EventKind.END, "amplifier at 0 V"))
sink.close()
os._exit(0)
"""


@pytest.mark.usefixtures("vulkan")
def test_an_attached_viewer_shows_a_trip_after_the_server_is_gone(tmp_path: Path) -> None:
    """It has just connected: 10 MB of the run are still to be sent."""
    with subprocess.Popen(
        [sys.executable, "-c", _RUN],
        cwd=Path(__file__).parents[2],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as run:
        assert run.stdout is not None
        port = int(run.stdout.readline())
        with headless_viewer("--connect", window.proxy_url(port)) as viewer:
            until(lambda: window._unsent(port), "the viewer was connected")  # noqa: SLF001
            run.communicate("\n", timeout=_TIMEOUT_S)
            assert run.returncode == 0
            wait_until_loaded(viewer)
            until(lambda: _first_time(viewer) == 0, "the viewer had the beginning")
            picture = tmp_path / "after.png"
            draw(viewer, picture)
    assert coloured(picture, MARKS["trip"].colour) > _MARKS_PIXELS_MIN


def _first_time(viewer: ViewerClient) -> int | None:
    """Return the oldest time of the run (ns) that the viewer has."""
    (times,) = [one for one in viewer.get_recording_schema().timelines if one.name == "loop_time"]
    return times.start


@contextmanager
def _connected() -> Iterator[tuple[int, socket.socket, socket.socket]]:
    """Yield a port, and both ends of a connection to it."""
    with socket.socket() as server:
        server.bind((window.LOOPBACK, 0))
        server.listen()
        port = server.getsockname()[1]
        with socket.create_connection((window.LOOPBACK, port)) as client, server.accept()[0] as connection:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)  # or the kernel makes it longer
            yield port, connection, client


@pytest.fixture
def pauses(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return the times (s) for which viewers are waited for, one after the other."""
    made: list[float] = []
    monkeypatch.setattr(window, "pause", made.append)
    return made


def _fill(connection: socket.socket) -> None:
    """Send until neither end takes more, and the kernel has moved what it can from one to the other."""
    connection.setblocking(False)
    port, waiting = connection.getsockname()[1], [-1]
    while waiting != window._unsent(port):  # noqa: SLF001 - that is what is waited for
        waiting = window._unsent(port)  # noqa: SLF001
        with suppress(BlockingIOError):
            while True:
                connection.send(b"\0" * 65_536)
        time.sleep(0.25)


def test_a_viewer_that_takes_nothing_is_waited_for_a_second(pauses: list[float]) -> None:
    with _connected() as (port, connection, _):
        _fill(connection)
        window.let_viewers_catch_up(port)
    assert 0.9 < sum(pauses) < 2.0


def test_a_viewer_is_waited_for_until_it_has_everything() -> None:
    with _connected() as (port, connection, client):
        _fill(connection)
        reader = threading.Thread(target=lambda: [None for _ in iter(lambda: client.recv(1 << 20), b"")])
        reader.start()
        window.let_viewers_catch_up(port)
        assert window._unsent(port) == [0]  # noqa: SLF001 - that is what it waits for
        connection.close()
        reader.join()


def test_there_is_nothing_to_wait_for_without_a_viewer(pauses: list[float]) -> None:
    with _connected() as (port, connection, client):
        client.close()
        connection.close()
        window.let_viewers_catch_up(port)
    assert pauses == []
