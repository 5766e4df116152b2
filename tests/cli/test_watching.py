"""Ways to watch a run, and what is said where one is missing."""

from __future__ import annotations

import os
import subprocess
import sys
import urllib.request
from contextlib import contextmanager
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.cli.execute_view import attach
from dcmp_hil.cli.run_sinks import dashboard
from dcmp_hil.cli.viewer import chosen, open_browser, pages
from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.telemetry.runs import VIEW

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.telemetry.rerun.sink import Viewer

_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
_FIRST_PORT = 25_000 + 1000 * _WORKER  # each process its own ports


@pytest.fixture(autouse=True)
def _elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take ports that no run on this computer takes, and no display."""
    monkeypatch.setattr(window, "VIEWER_PORT", _FIRST_PORT)
    monkeypatch.setattr(window, "WEB_PORT", _FIRST_PORT + 500)
    monkeypatch.setattr(window.served, "__defaults__", (_FIRST_PORT,))
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def run() -> Iterator[RerunSink]:
    """Serve a run."""
    sink = RerunSink(VIEW, None, "serve", port=_FIRST_PORT)
    assert sink.port is not None
    assert window.answers(sink.port, 5.0)
    yield sink
    sink.close()


_LISTENS = """
import socket, sys
with socket.socket() as listening:
    listening.bind(("127.0.0.1", 0))
    listening.listen()
    print(listening.getsockname()[1], flush=True)
    sys.stdin.read()
"""


@contextmanager
def _taken() -> Iterator[int]:
    """Yield a port on which another process listens."""
    with subprocess.Popen(
        [sys.executable, "-c", _LISTENS], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        yield int(other.stdout.readline())


def said(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().err.split())


def test_a_served_run_says_where_it_is_served_and_not_where_it_was_to_be(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with _taken() as taken:  # between the look for a free port and its use
        free = window.free_ports(_FIRST_PORT)
        monkeypatch.setattr(window, "free_ports", lambda _: iter([taken, next(free)]))
        sink = dashboard(VIEW, None, "serve", taken)
        assert f"rerun --connect rerun+http://127.0.0.1:{_FIRST_PORT}/proxy" in said(capsys)
        assert window.speaks_http2(_FIRST_PORT, 60.0)
        sink.close()


@pytest.mark.parametrize("viewer", ["connect", "none"])
def test_other_ways_are_the_sink_s_own_business(viewer: Viewer, capsys: pytest.CaptureFixture[str]) -> None:
    assert chosen(viewer) == viewer
    sink = dashboard(VIEW, None, viewer, _FIRST_PORT)
    assert isinstance(sink, RerunSink)
    sink.close()
    assert not said(capsys)


@pytest.mark.parametrize("viewer", ["serve", "web"])
def test_without_a_free_port_the_run_goes_on_unwatched(
    viewer: Viewer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window, "free_ports", lambda _: iter([]))
    sink = dashboard(VIEW, None, viewer, _FIRST_PORT)
    assert "No port from" in sink.warnings[0]  # type: ignore[attr-defined]
    sink.close()


def test_pages_are_served_on_loopback_as_long_as_the_run_lasts(capsys: pytest.CaptureFixture[str]) -> None:
    sink = dashboard(VIEW, None, "web", _FIRST_PORT)
    address = said(capsys).removeprefix("web viewer: ")
    assert address == window.web_url(_FIRST_PORT + 500, _FIRST_PORT)
    with urllib.request.urlopen(address, timeout=60.0) as page:  # noqa: S310 - our own
        assert page.status == 200
        assert b"<html" in page.read().lower()
    sink.close()
    assert not window.answers(_FIRST_PORT + 500, 0.1)


def test_pages_are_told_where_they_are_and_not_where_they_were_to_be(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with _taken() as taken:
        monkeypatch.setattr(window, "free_ports", lambda _: iter([taken, _FIRST_PORT + 700]))
        with pages(_FIRST_PORT) as address:
            assert address == window.web_url(_FIRST_PORT + 700, _FIRST_PORT)
    assert not said(capsys)


def test_a_web_viewer_that_does_not_start_costs_a_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(*_: int) -> None:
        raise FileNotFoundError("no such program")

    monkeypatch.setattr(window, "start_web_viewer", missing)
    dashboard(VIEW, None, "web", _FIRST_PORT).close()
    assert "No web viewer (no such program); to watch: dcmp-hil view" in said(capsys)


def test_no_browser_is_a_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr("dcmp_hil.cli.viewer.display_problem", lambda: "")
    monkeypatch.setattr("webbrowser.open", lambda _: False)
    open_browser("http://127.0.0.1")
    assert "No browser was found; open the address above in one." in said(capsys)


# ----------------------------------------------------------------------------------------------- view


def test_view_finds_the_run_and_opens_a_window(
    run: RerunSink, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[int] = []
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(window, "start_viewer", opened.append)
    monkeypatch.setattr("dcmp_hil.cli.execute_view.display_problem", lambda: "")
    attach(None, web=False)
    assert opened == [run.port]
    assert "the run goes on" in said(capsys)


@pytest.mark.usefixtures("run")
def test_view_without_a_display_says_what_else_there_is() -> None:
    with pytest.raises(ConfigError, match="there is no display") as caught:
        attach(None, web=False)
    assert "Use --web" in str(caught.value)
    assert "ssh -L" in str(caught.value)


def test_view_without_a_run_says_how_to_start_one() -> None:
    with pytest.raises(ConfigError, match="No run is served"):
        attach(None, web=False)
    with pytest.raises(ConfigError, match=f"No run is served on .*:{_FIRST_PORT + 333}"):
        attach(_FIRST_PORT + 333, web=False)


@pytest.mark.usefixtures("run")
def test_view_of_several_asks_which() -> None:
    other = RerunSink(VIEW, None, "serve", port=_FIRST_PORT)
    assert other.port is not None
    assert window.answers(other.port, 5.0)
    with pytest.raises(ConfigError, match=r"Several are served: .* Name one with --port"):
        attach(None, web=False)
    other.close()


def test_a_page_ends_with_its_run(run: RerunSink, monkeypatch: pytest.MonkeyPatch) -> None:
    looks = []

    def look(_: float) -> None:
        looks.append(window.answers(_FIRST_PORT + 500, 0.1))
        run.close()

    monkeypatch.setattr("dcmp_hil.cli.execute_view.pause", look)
    attach(run.port, web=True)
    assert looks[0]
    assert not window.answers(_FIRST_PORT + 500, 0.1)
