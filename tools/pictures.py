"""The dashboard as the viewers draw it: python -m tools.pictures [FOLDER] [--size WxH ...].

The run is in virtual time, so that every picture shows the same: a gain is changed at 11 s, and the arm is
pushed at 13 s, which trips the run. With --readme the panel is drawn, too.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil import load_rig
from dcmp_hil.cli.viewer import pages
from dcmp_hil.errors import TripError
from dcmp_hil.live.tunables import changed
from dcmp_hil.platform.clock import MonotonicClock, pause
from dcmp_hil.session import Session
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.rerun.marks import MARKS
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.viewer import proxy_url
from dcmp_hil.values import Event
from tests.live.here import Here
from tests.panel.browser import browser
from tests.telemetry.pixels import coloured
from tools.panel_picture import draw_panel
from tools.screenshot import Seen, draw, headless_viewer, wait_until_loaded

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rerun.experimental import ViewerClient
    from selenium.webdriver import Chrome

    from dcmp_hil.config import Rig
    from dcmp_hil.telemetry.rerun.rig_view import RigView

SIZES = ("1366x768", "1600x900", "1920x1080")
STATES = ("running", "tripped")
CHANGED_AT_S, PUSHED_AT_S, SHOWN_AT_S = 11.0, 13.0, 12.0
FIRST_PORT = 23_500  # of the ports tried for the recording's server
_BLOCK_ROWS = 100
_GREETING_TIME_S = 5.0  # s after the start, the viewer's first notice leaves the picture
_CATCH_UP_TIMEOUT_S = 240.0  # s
_WEB_SETTLE_TIME_S = 0.5  # s between two pictures; without a graphics card one takes as long
_LOADING_SIZE = "640x480"  # of a page that loads: it is drawn all the time, at the cost of what it loads
_SIGNS = {
    "running": ((71, 149, 75), MARKS["change"].colour),
    "tripped": ((188, 63, 63), MARKS["trip"].colour),
}
"""Colours of a state in the web viewer: of its lane as it is drawn, and of the newest mark."""
_SIGN_PIXELS_MIN = 300
README_PICTURES = {
    "dashboard.png": "native-running-1600x900.png",
    "dashboard-trip.png": "native-tripped-1600x900.png",
}
"""What README and docs/dashboard.md show, by its name in docs/images."""
_PANEL_PICTURE = "panel.png"
_IMAGES = Path(__file__).parents[1] / "docs" / "images"


class Tape:
    """A sink that keeps blocks and events in their order, and changes a gain during the run.

    Parameters
    ----------
    rig
        What is run.
    """

    def __init__(self, rig: Rig) -> None:
        self.items: list[Block | Event] = []
        self.control = Here()
        self._rig = rig
        self._asked = False

    def block(self, block: Block) -> None:
        """Keep a block; ask for the change at its time."""
        self.items.append(block)
        if block["t"][-1] > CHANGED_AT_S - 1.0 and not self._asked:  # it is taken a block, a second, later
            self._asked = True
            _, change = changed(self._rig, ["controller.kp_1_s2=5200"])
            self.control.mailbox.put(change)

    def event(self, event: Event) -> None:
        """Keep an event."""
        self.items.append(event)

    def close(self) -> None:
        """Nothing to finish."""


@cache
def story() -> tuple[RigView, tuple[Block | Event, ...]]:
    """Return a rig, and the blocks and events of its run, in their order."""
    rig = load_rig("bench-1khz", [])
    tape = Tape(rig)
    faults = [f"plant.shove:at={PUSHED_AT_S:g}s"]
    run = Session(rig, duration=20.0, fast=True, sinks=[tape], control=tape.control, faults=faults)
    try:
        run.run()
    except TripError:
        return view_of(rig), tuple(_in_order(tape.items))
    raise RuntimeError("the run of the pictures did not trip")


def _in_order(items: list[Block | Event]) -> Iterator[Block | Event]:
    """Yield short blocks, and each event before the block that follows it: those of virtual time are long."""
    events = sorted((one for one in items if isinstance(one, Event)), key=lambda event: event.t)
    for block in (one for one in items if isinstance(one, Block)):
        for place in range(0, len(block), _BLOCK_ROWS):
            piece = Block(block.rows[place : place + _BLOCK_ROWS], block.model)
            while events and events[0].t <= piece["t"][-1]:
                yield events.pop(0)
            yield piece
    yield from events


def at(item: Block | Event) -> float:
    """Return the time of the newest of it, s."""
    return item.t if isinstance(item, Event) else float(item["t"][-1])


class Stage:
    """A recording server that is fed the story, state by state."""

    def __init__(self) -> None:
        rig, items = story()
        self._left = list(items)
        self.sink = RerunSink(rig, None, "serve", port=FIRST_PORT)
        if self.sink.port is None:
            raise OSError(self.sink.warnings[0])
        self.port = self.sink.port
        self.now = 0.0  # s

    def go_on(self, state: str) -> None:
        """Feed what comes until that state: all of it until it is tripped."""
        while self._left and (state == "tripped" or at(self._left[0]) < SHOWN_AT_S):
            item = self._left.pop(0)
            self.now = at(item)
            if isinstance(item, Event):
                self.sink.event(item)
            else:
                self.sink.block(item)


def native(folder: Path, size: str) -> Iterator[tuple[str, Path, ViewerClient]]:
    """Yield each state with its picture, while the native viewer shows it."""
    stage = Stage()
    with headless_viewer("--connect", proxy_url(stage.port), size=size) as viewer:
        stage.go_on(STATES[0])
        wait_until_loaded(viewer)
        pause(_GREETING_TIME_S)
        for state in STATES:
            stage.go_on(state)
            if state == STATES[-1]:
                stage.sink.close()
            _catch_up(viewer, stage.now)
            picture = folder / f"native-{state}-{size}.png"
            draw(viewer, picture)
            yield state, picture, viewer


def _catch_up(viewer: ViewerClient, now: float) -> None:
    """Wait until the viewer has the data of `now`, s.

    Raises
    ------
    TimeoutError
        If they do not come.
    """
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(_CATCH_UP_TIMEOUT_S * 1e9)
    while clock.now_ns() < end_ns:
        shown = [r.current_time or 0 for r in viewer.get_state().recordings if r.current_timeline]
        if shown and 1e-9 * max(shown) >= now - 1e-6:
            return
        pause(0.1)
    raise TimeoutError(f"the viewer does not show {now:g} s of the run after {_CATCH_UP_TIMEOUT_S:g} s")


def web(folder: Path, *sizes: str) -> Iterator[tuple[str, Path]]:
    """Yield each state with its picture in the web viewer, at each size."""
    stage = Stage()
    with (
        tempfile.TemporaryDirectory() as profile,
        pages(stage.port) as address,
        browser(Path(profile), draws=True) as page,
    ):
        _resize(page, _LOADING_SIZE)
        stage.go_on(STATES[0])
        page.get(address)
        _draw_page(page, Path(profile) / "loaded.png", _SIGNS[STATES[0]][:1])
        for state, order in zip(STATES, (sizes, sizes[::-1]), strict=True):  # of one size two in a row
            stage.go_on(state)
            if state == STATES[-1]:
                stage.sink.close()
            for size in order:
                _resize(page, size)
                picture = folder / f"web-{state}-{size}.png"
                _draw_page(page, picture, _SIGNS[state])
                yield state, picture


def _resize(page: Chrome, size: str) -> None:
    width, height = (int(word) for word in size.split("x"))
    page.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False},
    )


def _draw_page(page: Chrome, picture: Path, signs: Sequence[tuple[int, int, int]]) -> None:
    """Save a page as soon as the colours of a state are on it, and two pictures in a row are alike.

    Raises
    ------
    TimeoutError
        If one of them does not appear, or the page does not come to rest.
    """
    from selenium.common.exceptions import TimeoutException as BrowserTimeoutError

    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(_CATCH_UP_TIMEOUT_S * 1e9)
    before = b""
    while clock.now_ns() < end_ns:
        try:
            now = page.get_screenshot_as_png()
        except BrowserTimeoutError:  # after 10 s, on a busy computer
            continue
        picture.write_bytes(now)
        if now == before and min(coloured(picture, sign) for sign in signs) >= _SIGN_PIXELS_MIN:
            return
        before = now
        pause(_WEB_SETTLE_TIME_S)
    raise TimeoutError(f"the web viewer has not drawn {picture.name}, or does not come to rest")


def pictures(folder: Path, sizes: Sequence[str], *, pages_too: bool) -> None:
    """Draw every state at every size.

    Raises
    ------
    RuntimeError
        If the viewer complained about one of them.
    """
    for size in sizes:
        for state, _, viewer in native(folder, size):
            complaints = Seen(viewer.get_state(), viewer.get_logs()).complaints
            if complaints:
                raise RuntimeError(f"{state}, {size}: {'; '.join(complaints)}")
    if pages_too:
        for _ in web(folder, *sizes):
            pass


def main() -> int:
    """Draw the pictures; with --readme those of the README as well."""
    parser = argparse.ArgumentParser(prog="python -m tools.pictures", description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("reports/pictures"))
    parser.add_argument("--size", nargs="+", default=list(SIZES), metavar="WxH", help="pixels")
    parser.add_argument("--native", action="store_true", help="no web viewer")
    parser.add_argument(
        "--readme",
        action="store_true",
        help="draw the panel, too, and renew docs/images",
    )
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    pictures(args.folder, args.size, pages_too=not args.native)
    if args.readme:
        draw_panel(args.folder / _PANEL_PICTURE)
        for name, source in {**README_PICTURES, _PANEL_PICTURE: _PANEL_PICTURE}.items():
            shutil.copyfile(args.folder / source, _IMAGES / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
