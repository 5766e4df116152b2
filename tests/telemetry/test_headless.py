"""A recording and a live run in a real viewer, drawn without a display."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from dcmp_hil.platform.clock import pause
from dcmp_hil.telemetry.rerun import sink as rerun_sink
from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.signals import ERROR_RGB, ESTIMATE_RGB, VOLTAGE_RGB
from tests.telemetry.pixels import coloured
from tests.telemetry.runs import EVENTS, VIEW, blocks, feed, values
from tools import screenshot as screenshots
from tools.screenshot import headless_viewer, look, screenshot, wait_until_loaded

if TYPE_CHECKING:
    from collections.abc import Iterator

_REPORTS = Path("reports")
_LOOPBACK = {"0100007F", "00000000000000000000000001000000", "0000000000000000FFFF00000100007F"}
_VIEWS = {
    *("Position [rad]", "Velocity [rad/s]", "Disturbance [rad/s²]", "Position errors [mrad]", "Voltage [V]"),
    *(
        "Timing, worst [µs]",
        "All periods [µs]",
        "Phase and states",
        "Events",
        "State",
        "Velocity errors [mrad/s]",
        "Disturbance: estimate error, rest [rad/s²]",
        "Parameters",
        "Pendulum (true)",
        "Phase portrait",
    ),
}


pytestmark = pytest.mark.usefixtures("vulkan")


class OpenWindow:
    """A window that is not closed."""

    def poll(self) -> None:
        """Return None: the window is still open."""


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Iterator[RerunSink]:
    """Yield a sink that serves a live recording, its window replaced by nothing."""
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(window, "start_viewer", lambda _: OpenWindow())
    monkeypatch.setattr(rerun_sink, "display_problem", lambda: "")
    sink = RerunSink(VIEW, None, "spawn", port=23_000)
    yield sink
    sink.close()


def listening(process: int | str) -> set[str]:
    """Return the local addresses on which a process and its children listen."""
    root = Path("/proc") / str(process)
    inodes = set()
    for handle in (root / "fd").iterdir():
        try:
            inodes.add(str(handle.readlink()))
        except OSError:  # closed meanwhile
            continue
    found = set()
    for table in ("tcp", "tcp6"):
        for line in Path("/proc/net", table).read_text(encoding="ascii").splitlines()[1:]:
            fields = line.split()
            if fields[3] == "0A" and f"socket:[{fields[9]}]" in inodes:
                found.add(fields[1].partition(":")[0])
    for children in root.glob("task/*/children"):
        for child in children.read_text(encoding="ascii").split():
            found |= listening(child)
    return found


def test_a_recording_opens_right_without_a_click(tmp_path: Path) -> None:
    feed(RerunSink(VIEW, tmp_path / "run.rrd", "none"), periods=3000)
    seen = screenshot(tmp_path / "run.rrd", tmp_path / "run.png", at=2.0)
    _keep(tmp_path / "run.png")
    assert {view.name for view in seen.state.views if view.visible} >= _VIEWS
    assert seen.complaints == []
    (recording,) = [r for r in seen.state.recordings if r.store_id == seen.state.active_recording]
    assert (recording.current_timeline, recording.current_time) == ("loop_time", 2_000_000_000)
    for colour in (ESTIMATE_RGB, VOLTAGE_RGB, ERROR_RGB):
        assert coloured(tmp_path / "run.png", colour) > 100


def _keep(picture: Path) -> None:
    """Keep what was seen among the reports of CI."""
    _REPORTS.mkdir(exist_ok=True)
    shutil.copyfile(picture, _REPORTS / f"dashboard-{picture.name}")


def test_a_live_run_reaches_the_viewer_and_only_loopback_is_bound(served: RerunSink, tmp_path: Path) -> None:
    assert served.warnings == []
    assert served.port is not None
    made = blocks(3000)
    with headless_viewer("--connect", window.proxy_url(served.port)) as viewer:
        served.event(EVENTS[0])
        for block in made[:20]:
            served.block(block)
        wait_until_loaded(viewer)
        addresses = listening("self")
        for block in made[20:]:
            served.block(block)
        served.close()  # waits until the viewer has it all
        reached = _reached(viewer, 2_999_000_000)
        seen = look(viewer, tmp_path / "live.png")
    _keep(tmp_path / "live.png")
    assert reached == 2_999_000_000
    assert seen.complaints == []
    assert addresses
    assert addresses <= _LOOPBACK
    assert coloured(tmp_path / "live.png", ESTIMATE_RGB) > 100


_FROZEN = """
import os, signal, sys
from pathlib import Path
from dcmp_hil.telemetry.rerun import viewer as window
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.telemetry.runs import VIEW, blocks
window.VIEWER_PORT = int(sys.argv[1])
sink = RerunSink(VIEW, Path(sys.argv[3]), "connect")
made = blocks(3000)
for block in made[:10]:
    sink.block(block)
os.kill(int(sys.argv[2]), signal.SIGSTOP)
for block in made[10:]:
    sink.block(block)
sys.exit(len(sink.warnings))
"""


def test_a_viewer_that_freezes_keeps_neither_the_process_nor_the_file(tmp_path: Path) -> None:
    port = window.free_port(screenshots.FIRST_PORT)
    assert port is not None
    options = ["--headless", "--bind", window.LOOPBACK, "--port", str(port), "--hide-welcome-screen"]
    with subprocess.Popen(
        [window.viewer_binary(), *options],
        env=window.viewer_environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as viewer:
        try:
            assert window.answers(port, 30.0)
            arguments = [str(port), str(viewer.pid), str(tmp_path / "run.rrd")]
            done = subprocess.run([sys.executable, "-c", _FROZEN, *arguments], timeout=40, check=False)
        finally:
            viewer.kill()
    assert done.returncode == 0
    assert len(values(tmp_path / "run.rrd", "joint/position_rad/lines")) == 3000


def _reached(viewer: Any, wanted: int) -> int:
    """Follow the viewer's time until it is at `wanted`, ns, for 10 s at most."""
    now = -1
    for _ in range(100):
        state = viewer.get_state()
        now = max([r.current_time or -1 for r in state.recordings if r.store_id == state.active_recording])
        if now >= wanted:
            break
        pause(0.1)
    return now
