"""What is seen of the plots on a small screen, two hours after the start: ticks, numbers, legends, a trip."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.telemetry.rerun.plots import plots
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.signals import ERROR_RGB, ESTIMATE_RGB, REFERENCE_RGB, VOLTAGE_RGB
from dcmp_hil.values import Event, EventKind, PhaseData
from tests.telemetry.drawn_once import drawn_once
from tests.telemetry.pixels import pixels
from tests.telemetry.runs import VIEW, blocks
from tests.telemetry.test_marks import CHANGE, PHASE, TRIP
from tools.screenshot import draw, headless_viewer, wait_until_loaded

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

pytestmark = pytest.mark.usefixtures("vulkan")

_HOURS_S = 8000.0  # s: labels of ticks are longest then, "+2h 13m 20s"
_SIZE = "1366x768"
_SHOWN_TIME_S = 6.5  # s on the axis of a plot
_TICK_STRIP_PX, _NUMBER_STRIP_PX = 17, 40  # below a plot, left of it
_LABELLED_SHARE_MIN = 0.4  # of the columns, that letters light; 0.1 where one label of six is there
_DOT_PX = 14  # of a line's colour in the legend, with its edge
_TRIP_RGB, _CURSOR_RGB = (255, 40, 40), (200, 200, 200)
_LINES_RGB = (ESTIMATE_RGB, REFERENCE_RGB, ERROR_RGB, VOLTAGE_RGB)  # others are like letters


def write(path: Path, *, tripped: bool) -> None:
    """Write a run of 7 s that began two hours ago."""
    sink = RerunSink(VIEW, path, "none")
    sink.event(Event(_HOURS_S, "INFO", EventKind.PHASE, "running", PhaseData("running")))
    events = [event._replace(t=event.t + 5.0) for event in ([CHANGE, PHASE, TRIP] if tripped else [CHANGE])]
    for block in blocks(7000):
        while events and events[0].t <= block["t"][-1]:
            event = events.pop(0)
            sink.event(event._replace(t=event.t + _HOURS_S))
        block.rows[:, FIELDS.index("t")] += _HOURS_S
        sink.block(block)
    sink.close()


def _draw(tripped: bool, folder: Path) -> dict[str, str]:
    """Draw every plot; return the names of the pictures by title."""
    write(folder / "run.rrd", tripped=tripped)
    wanted = {plot.titled for plot in plots()}
    pictures: dict[str, str] = {}
    with headless_viewer(str(folder / "run.rrd"), size=_SIZE) as viewer:
        wait_until_loaded(viewer)
        at = _HOURS_S + (7.9 if tripped else 6.99)
        viewer.set_time("loop_time", duration=at, play_state="paused")
        draw(viewer, folder / "whole.png")
        for view in viewer.get_state().views:
            if view.name in wanted:
                pictures[view.name] = f"{len(pictures)}.png"
                draw(viewer, folder / pictures[view.name], view.view_id, calm=0.1)
    assert pictures.keys() == wanted
    return pictures


@pytest.fixture(scope="module", params=[False, True], ids=["running", "tripped"])
def seen(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, NDArray[np.int16]]:
    """Return the picture of every plot by its title."""
    folder, names = drawn_once(tmp_path_factory, f"seen-{request.param}", partial(_draw, request.param))
    return {title: pixels(folder / name) for title, name in names.items()}


def like(picture: NDArray[np.int16], colour: tuple[int, int, int], within: int = 30) -> NDArray[np.bool_]:
    """Return the pixels of about a colour."""
    found: NDArray[np.bool_] = np.abs(picture - np.array(colour)).max(axis=-1) < within
    return found


def texts(bright: NDArray[np.bool_], gap: int) -> int:
    """Count the words in a row of pixels: bright ones with more than a gap between them."""
    places = np.flatnonzero(bright)
    return 0 if not len(places) else 1 + int((np.diff(places) > gap).sum())


def test_every_second_has_a_tick(seen: dict[str, NDArray[np.int16]]) -> None:
    for name, picture in seen.items():
        assert picture.shape[1] / _SHOWN_TIME_S >= 65.0, name
        strip = picture[-_TICK_STRIP_PX:].min(axis=-1).max(axis=0)
        assert (strip > 120).mean() > _LABELLED_SHARE_MIN, name


def test_every_value_axis_has_three_numbers(seen: dict[str, NDArray[np.int16]]) -> None:
    for name, picture in seen.items():
        strip = picture[:-_TICK_STRIP_PX, :_NUMBER_STRIP_PX].min(axis=-1).max(axis=1)
        assert texts(strip > 90, gap=4) >= 3, name


def test_the_legend_covers_no_line(seen: dict[str, NDArray[np.int16]]) -> None:
    """Lines end at the cursor; on its right there is nothing of their colours but the legend's dots."""
    for name, picture in seen.items():
        inside = picture[:-_TICK_STRIP_PX]
        columns = np.flatnonzero(like(inside, _CURSOR_RGB, 60).mean(axis=0) > 0.8)
        assert len(columns), name
        future = inside[:, columns[-1] + 6 :]
        for colour in _LINES_RGB:
            found = like(future, colour)
            assert found.any(axis=0).sum() <= _DOT_PX, (name, colour)


def test_a_trip_is_a_mark_from_end_to_end_of_every_plot(
    seen: dict[str, NDArray[np.int16]], request: pytest.FixtureRequest
) -> None:
    tripped = "tripped" in request.node.name
    for name, picture in seen.items():
        inside = picture[:-_TICK_STRIP_PX]
        assert (like(inside, _TRIP_RGB).mean(axis=0).max() > 0.9) == tripped, name


def test_plots_are_red_after_a_trip(
    seen: dict[str, NDArray[np.int16]], request: pytest.FixtureRequest
) -> None:
    tripped = "tripped" in request.node.name
    for name, picture in seen.items():
        inside = picture[:-_TICK_STRIP_PX]
        redder = inside[..., 0] > inside[..., 1] + 20
        assert (redder.mean() > 0.5) == tripped, name
