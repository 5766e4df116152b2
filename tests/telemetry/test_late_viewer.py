"""A viewer that comes late, when the server has forgotten the beginning: what was sent once is there."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.platform.clock import MonotonicClock, pause
from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.values import ChangeData, Event, EventKind, PhaseData
from tests.telemetry.pixels import coloured, pixels
from tests.telemetry.runs import VIEW, blocks
from tools.screenshot import headless_viewer, wait_until_loaded

if TYPE_CHECKING:
    from pathlib import Path

    from rerun.experimental import ViewerClient

pytestmark = pytest.mark.usefixtures("vulkan")
_FIRST_PORT = 25_500  # of the ports; no other test serves there
_PERIODS = 60_000  # a minute
_HISTORY = "10MiB"  # of more than 30 that a minute takes; what is sent once comes again every 10 s
_TIMEOUT_S = 60.0  # s: generous, these machines are shared
_EVENTS = (
    Event(0.0, "INFO", EventKind.PHASE, "it runs", PhaseData("running")),
    Event(0.0, "INFO", EventKind.CHANGE, "kp: applied", ChangeData({"controller.kp_1_s2": 4500.0})),
    Event(0.0, "WARN", EventKind.OTHER, "an event of the beginning"),
)
_RUNNING_RGB = (71, 149, 75)  # of a lane, as it is drawn
_TITLE_ROWS = 30  # of a view's picture
_LIT_MIN = 200  # pixels; "(empty)" has less than half of it
_ONCE = {
    *("/params TextDocument:text", "/phase StateChange:state", "/voltage StateChange:state"),
    *("/samples StateChange:state", "/banner TextDocument:text", "/events/last TextDocument:text"),
    *("/portrait/axes LineStrips2D:strips", "/portrait/axes/ends Points2D:labels"),
    "/lamp LineStrips2D:strips",
}
"""Entities, with their component, that are sent once, or where they change."""
_LINES = "/joint/position_rad/lines Scalars:scalars"


def _served() -> RerunSink:
    sink = RerunSink(VIEW, None, "serve", port=_FIRST_PORT, history=_HISTORY)
    for event in _EVENTS:
        sink.event(event)
    for block in blocks(_PERIODS):
        sink.block(block)
    return sink


def _components(viewer: ViewerClient) -> set[str]:
    schema = viewer.get_recording_schema()
    return {f"{one.entity_path} {part.component}" for one in schema.entities for part in one.components}


def _wait_for(viewer: ViewerClient, wanted: set[str], last_s: float) -> set[str]:
    """Return the components that the viewer has, as soon as it has those, and the newest data, of the run.

    The newest come first, so that the oldest that the server has come last.
    """
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(_TIMEOUT_S * 1e9)
    while True:
        found = _components(viewer)
        ends = [one.end or 0 for one in viewer.get_recording_schema().timelines if one.name == "loop_time"]
        if (wanted <= found and ends and 1e-9 * ends[0] > last_s) or clock.now_ns() > end_ns:
            return found
        pause(0.1)


def _shown(viewer: ViewerClient, name: str, picture: Path) -> Path:
    """Save a picture of one view, once it is drawn."""
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(_TIMEOUT_S * 1e9)
    while True:
        try:
            (view,) = [one for one in viewer.get_state().views if one.name == name]
            viewer.save_screenshot(str(picture), view_id=view.view_id)
        except (ConnectionError, ValueError):  # the layout has come, and no picture of it was drawn yet
            if clock.now_ns() > end_ns:
                raise
            pause(0.1)
        else:
            return picture


def _lit(picture: Path) -> int:
    """Count the pixels of text below a title."""
    return int((pixels(picture)[_TITLE_ROWS:].max(axis=-1) > 150).sum())


def test_what_is_sent_once_is_there_when_the_beginning_is_gone(tmp_path: Path) -> None:
    sink = _served()
    assert sink.port is not None
    with headless_viewer("--connect", window.proxy_url(sink.port)) as viewer:
        wait_until_loaded(viewer)
        found = _wait_for(viewer, _ONCE | {_LINES}, 59.9)
        lane = _shown(viewer, "Phase and states", tmp_path / "lane.png")
        words = {name: _lit(_shown(viewer, name, tmp_path / "text.png")) for name in ("Parameters", "Events")}
        complaints = [r.summary for view in viewer.get_state().views for r in view.reports]
    sink.close()
    assert (_ONCE | {_LINES}) - found == set()
    assert "/events/log TextLog:text" not in found  # the beginning is gone indeed
    assert coloured(lane, _RUNNING_RGB) > 500
    assert {name: lit for name, lit in words.items() if lit < _LIT_MIN} == {}
    assert complaints == []
