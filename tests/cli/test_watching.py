"""Ways to watch a run, and what is said where one is missing."""

from __future__ import annotations

import os
import urllib.request
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.cli.viewing import attach
from dcmp_hil.cli.watching import watched
from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry import viewer as window
from dcmp_hil.telemetry.rerun_sink import RerunSink
from tests.telemetry.runs import VIEW

if TYPE_CHECKING:
    from collections.abc import Iterator

_FIRST = 25_000 + 1000 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])  # each process its own ports


@pytest.fixture(autouse=True)
def _elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take ports that no run on this computer takes, and no display."""
    monkeypatch.setattr(window, "PORT", _FIRST)
    monkeypatch.setattr(window, "WEB_PORT", _FIRST + 500)
    monkeypatch.setattr(window.free_port, "__defaults__", (_FIRST,))
    monkeypatch.setattr(window.served, "__defaults__", (_FIRST,))
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def run() -> Iterator[RerunSink]:
    """Serve a run."""
    sink = RerunSink(VIEW, None, "serve", port=_FIRST)
    assert sink.port is not None
    assert window.answers(sink.port, 5.0)
    yield sink
    sink.close()


def said(capsys: pytest.CaptureFixture[str]) -> str:
    return " ".join(capsys.readouterr().err.split())


def test_a_served_run_waits_for_viewers_and_says_where(capsys: pytest.CaptureFixture[str]) -> None:
    with watched("serve") as (viewer, port):
        assert viewer == "serve"
        assert f"rerun --connect rerun+http://127.0.0.1:{port}/proxy" in said(capsys)


@pytest.mark.parametrize("viewer", ["spawn", "connect", "none"])
def test_other_ways_are_the_sink_s_own_business(viewer: str, capsys: pytest.CaptureFixture[str]) -> None:
    with watched(viewer) as (after_all, _):  # type: ignore[arg-type]
        assert after_all == viewer
    assert not said(capsys)


@pytest.mark.parametrize("viewer", ["serve", "web"])
def test_without_a_free_port_the_run_goes_on_unwatched(
    viewer: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(window, "free_port", lambda *_: None)
    with watched(viewer) as (after_all, _):  # type: ignore[arg-type]
        assert after_all == "none"
    assert "No port from" in said(capsys)


def test_pages_are_served_on_loopback_as_long_as_the_run_lasts(capsys: pytest.CaptureFixture[str]) -> None:
    with watched("web") as (viewer, port):
        assert viewer == "web"
        address = said(capsys).removeprefix("web viewer: ")
        assert address == window.web_url(_FIRST + 500, port)
        with urllib.request.urlopen(address, timeout=10.0) as page:  # noqa: S310 - our own
            assert page.status == 200
            assert b"<html" in page.read().lower()
    assert not window.answers(_FIRST + 500, 0.1)


def test_a_web_viewer_that_does_not_start_costs_a_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(*_: int) -> None:
        raise FileNotFoundError("no such program")

    monkeypatch.setattr(window, "start_web_viewer", missing)
    with watched("web") as (viewer, _):
        assert viewer == "web"  # whoever has a viewer may come
    assert "No web viewer (no such program); to watch: dcmp-hil view" in said(capsys)


def test_no_browser_is_a_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr("webbrowser.open", lambda _: False)
    with watched("web"):
        pass
    assert "No browser was found; open the address above in one." in said(capsys)


# ----------------------------------------------------------------------------------------------- view


def test_view_finds_the_run_and_opens_a_window(
    run: RerunSink, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[int] = []
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(window, "start_viewer", opened.append)
    attach(None, web=False)
    assert opened == [run.port]
    assert "the run goes on" in said(capsys)


@pytest.mark.usefixtures("run")
def test_view_without_a_display_says_what_else_there_is() -> None:
    with pytest.raises(ConfigError, match="There is no display") as caught:
        attach(None, web=False)
    assert "Use --web" in str(caught.value)
    assert "ssh -L" in str(caught.value)


def test_view_without_a_run_says_how_to_start_one() -> None:
    with pytest.raises(ConfigError, match="No run is served"):
        attach(None, web=False)
    with pytest.raises(ConfigError, match=f"Nobody serves a run on .*:{_FIRST + 333}"):
        attach(_FIRST + 333, web=False)


@pytest.mark.usefixtures("run")
def test_view_of_several_asks_which() -> None:
    other = RerunSink(VIEW, None, "serve", port=_FIRST)
    assert other.port is not None
    assert window.answers(other.port, 5.0)
    with pytest.raises(ConfigError, match=r"Several are served: .* Name one with --port"):
        attach(None, web=False)
    other.close()


def test_a_page_ends_with_its_run(run: RerunSink, monkeypatch: pytest.MonkeyPatch) -> None:
    looks = []

    def look(_: float) -> None:
        looks.append(window.answers(_FIRST + 500, 0.1))
        run.close()

    monkeypatch.setattr("dcmp_hil.cli.viewing.pause", look)
    attach(run.port, web=True)
    assert looks[0]
    assert not window.answers(_FIRST + 500, 0.1)
