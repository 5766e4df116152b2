"""Picture of a recording: python -m tools.screenshot FILE.rrd OUT.png [--at SECONDS] [--size 1600x900]."""

from __future__ import annotations

import argparse
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.platform.clock import MonotonicClock, pause
from dcmp_hil.telemetry.rerun.viewer import (
    LOOPBACK,
    answers,
    free_port,
    proxy_url,
    viewer_binary,
    viewer_environment,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from uuid import UUID

    from rerun.experimental import LogEntry, ViewerClient, ViewerState

APT = "apt-get install -y --no-install-recommends mesa-vulkan-drivers libvulkan1"
_START_TIMEOUT_S = 30.0  # s: the first picture of a software renderer takes a while
_LOAD_TIMEOUT_S = 60.0  # s
_SETTLE_TIME_S = 0.7  # s after a seek
_CALM_TIME_S = 1.0  # s without a change
_TRIALS_MAX, _SAVE_TRIALS_MAX = 30, 8  # pictures, and looks for one
_GREETING_TIME_S = 5.0  # s after the start, the viewer's first notice leaves the picture
_OF_THE_MACHINE = ("Software rasterizer", "Failed to render screenshot")  # which `save` asks for again
FIRST_PORT = 21_000  # tried for the viewer's remote control


@dataclass(frozen=True, slots=True)
class Seen:
    """Report of a viewer on a displayed recording."""

    state: ViewerState
    logs: list[LogEntry]

    @property
    def complaints(self) -> list[str]:
        """The problems that a view or the viewer itself reported."""
        reports = [f"{v.name}: {r.summary}" for v in self.state.views for r in v.reports]
        return reports + [f"{e.level} {e.target}: {e.message}" for e in self.logs if _is_complaint(e)]


def _is_complaint(entry: LogEntry) -> bool:
    """Return whether a report concerns the recording, and not a machine: busy, or without a graphics card."""
    return entry.level in {"WARN", "ERROR"} and not any(words in entry.message for words in _OF_THE_MACHINE)


@contextmanager
def headless_viewer(*sources: str, size: str = "1600x900") -> Iterator[ViewerClient]:
    """Run a viewer without a window on `sources` (files or addresses), and hand out its remote control."""
    from rerun.experimental import ViewerClient

    port = free_port(FIRST_PORT)
    if port is None:
        raise OSError(f"no free port from {FIRST_PORT} on")
    options = ["--headless", "--bind", LOOPBACK, "--port", str(port), "--hide-welcome-screen"]
    options += ["--window-size", size, "--memory-limit", "1GB"]
    with subprocess.Popen(  # noqa: S603 - the binary of our own dependency
        [viewer_binary(), *options, *sources],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=viewer_environment(),
    ) as process:
        try:
            if not answers(port, _START_TIMEOUT_S):
                raise OSError(f"the headless viewer did not start; it needs Vulkan: {APT}")
            yield ViewerClient.connect(proxy_url(port))
        finally:
            process.kill()


def wait_until_loaded(viewer: ViewerClient, within: float = _LOAD_TIMEOUT_S) -> ViewerState:
    """Return the viewer's state once a recording is there whole and a view shows it.

    Raises
    ------
    OSError
        If the viewer reports an error.
    TimeoutError
        With what the viewer is still loading.
    """
    clock = MonotonicClock()
    end_ns = clock.now_ns() + int(within * 1e9)
    while True:
        state = viewer.get_state()
        shown = [r for r in state.recordings if r.store_id == state.active_recording and r.timelines]
        if shown and state.views and not state.loading:
            return state
        errors = [entry.message for entry in viewer.get_logs() if entry.level == "ERROR"]
        if errors:
            raise OSError("the viewer could not show the recording: " + "; ".join(errors))
        if clock.now_ns() > end_ns:
            waiting = ", ".join(source.status for source in state.loading) or "nothing"
            raise TimeoutError(f"no recording on the screen after {within:g} s; still loading: {waiting}")
        pause(0.1)


def save(viewer: ViewerClient, picture: Path, view_id: str | UUID | None = None) -> None:
    """Save what `viewer` draws next; see `draw`.

    Raises
    ------
    ConnectionError, TimeoutError
        If it draws nothing.
    """
    for left in reversed(range(_SAVE_TRIALS_MAX)):
        try:
            viewer.save_screenshot(str(picture.resolve()), view_id)
        except (ConnectionError, TimeoutError):  # a busy computer draws nothing for the 15 s that Rerun waits
            if not left:
                raise
        else:
            return


def draw(
    viewer: ViewerClient, picture: Path, view_id: str | UUID | None = None, calm: float = _CALM_TIME_S
) -> None:
    """Save a picture of what `viewer` shows as soon as two in a row are alike.

    Parameters
    ----------
    viewer
        Its remote control.
    picture
        The .png file.
    view_id
        The view; None for the whole window.
    calm
        s between two pictures.

    Raises
    ------
    TimeoutError
        If no two of 30 are.
    """
    before = b""
    for _ in range(_TRIALS_MAX):
        pause(calm)
        save(viewer, picture, view_id)
        now = picture.read_bytes()
        if now == before:
            return
        before = now
    raise TimeoutError(f"{picture.name}: the viewer did not come to rest in {_TRIALS_MAX} pictures")


def look(
    viewer: ViewerClient, picture: Path, at: float | None = None, settle: float = _SETTLE_TIME_S
) -> Seen:
    """Save a picture of what `viewer` shows, at `at` s of the run or where it stands, and say what it is."""
    wait_until_loaded(viewer)
    if at is not None:
        viewer.set_time("loop_time", duration=at, play_state="paused")
    pause(settle)
    save(viewer, picture)
    return Seen(viewer.get_state(), viewer.get_logs())


def screenshot(recording: Path, picture: Path, *, at: float | None = None, size: str = "1600x900") -> Seen:
    """Draw a recording as the viewer shows it, without a display.

    Parameters
    ----------
    recording
        The .rrd file.
    picture
        The .png file.
    at
        s of the run; None for where the viewer opens.
    size
        Of the window, pixels.
    """
    with headless_viewer(str(recording.resolve(strict=True)), size=size) as viewer:
        return look(viewer, picture, at, _GREETING_TIME_S)


def main() -> int:
    """Draw one recording; 1 if the viewer complained about it."""
    parser = argparse.ArgumentParser(prog="python -m tools.screenshot", description=__doc__)
    parser.add_argument("recording", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--at", type=float, metavar="SECONDS", help="time of the run")
    parser.add_argument("--size", default="1600x900", metavar="WxH", help="pixels")
    args = parser.parse_args()
    seen = screenshot(args.recording, args.picture, at=args.at, size=args.size)
    for complaint in seen.complaints:
        sys.stderr.write(complaint + "\n")
    return 1 if seen.complaints else 0


if __name__ == "__main__":
    sys.exit(main())
