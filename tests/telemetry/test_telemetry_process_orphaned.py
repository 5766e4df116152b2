"""Telemetry in a process of its own: what the death of the run, or a full disk, costs."""

from __future__ import annotations

import signal
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig, run
from dcmp_hil.telemetry.rerun.sink import RerunSink
from tests.live.processes import until
from tests.telemetry.runs import VIEW, values
from tests.telemetry.sinks import TIMEOUT_S, noted

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.telemetry.recorder import Sink

pytestmark = pytest.mark.usefixtures("nothing_left")

_RUNS_ON = """
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from dcmp_hil import load_rig, run
from dcmp_hil.telemetry.rerun.sink import RerunSink
from dcmp_hil.telemetry.rerun.rig_view import view_of
from tests.telemetry.sinks import Notes
rig = load_rig("bench-1khz")
folder = Path(sys.argv[1])
dashboard = partial(RerunSink, rig=view_of(rig), record=folder / "run.rrd", viewer="none")
run(rig, duration=0, sinks=[dashboard, partial(Notes, folder / "notes")])
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_the_process_drains_the_ring_and_leaves_when_we_are_killed(
    tmp_path: Path, number: signal.Signals
) -> None:
    notes = tmp_path / "notes"
    with subprocess.Popen([sys.executable, "-c", _RUNS_ON, str(tmp_path)], stderr=subprocess.PIPE) as process:
        until(lambda: notes.exists() and len(noted(notes, "rows")) >= 5, "rows came")
        process.send_signal(number)
        process.communicate(timeout=TIMEOUT_S)  # until every process with its standard error has ended, too
    pid = int(noted(notes, "pid")[0])
    until(lambda: not Path(f"/proc/{pid}").exists(), "it ended")
    assert noted(notes, "closed") == [""]
    periods = sum(map(int, noted(notes, "rows")))
    assert len(values(tmp_path / "run.rrd", "joint/position_rad/lines")) == periods


def test_a_full_disk_costs_one_warning(tmp_path: Path) -> None:
    maker: Callable[[], Sink] = partial(_limited, tmp_path / "run.rrd")
    result = run(load_rig("bench-1khz"), duration=3.0, sinks=[maker])
    assert result.summary.periods == 3000
    assert result.dropped == 0
    (trouble,) = result.troubles
    assert "incomplete" in trouble or "taken nothing" in trouble


def _limited(file: Path) -> Sink:
    """Make a recording that may not grow beyond what fits our own files in memory."""
    import resource

    sink = RerunSink(VIEW, file, "none")
    resource.setrlimit(resource.RLIMIT_FSIZE, (900_000, resource.RLIM_INFINITY))
    return sink
