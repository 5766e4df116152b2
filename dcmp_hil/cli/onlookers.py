"""Whoever looks on at a run, made in the telemetry process.

Apart from the run itself, whose imports that process would wait for half a second.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.cli import console, streams
from dcmp_hil.cli.status import StatusLine

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.telemetry.audience import Sink
    from dcmp_hil.telemetry.rerun_sink import Viewer
    from dcmp_hil.telemetry.rig_view import RigView


def status_line(period: float) -> Sink:
    """Return the status line of a run whose samples come every `period` (s)."""
    streams.guard()
    return StatusLine(console.err, period)


def recording(path: Path, period: float, run: dict[str, str], rig: str) -> Sink:
    """Return the run's own recording."""
    from dcmp_hil.recording.writer import Recording

    return Recording(path, period, run, rig)


def dashboard(view: RigView, record: Path | None, viewer: Viewer, port: int) -> Sink:
    """Return the Rerun dashboard, its recording, or both."""
    from dcmp_hil.telemetry.rerun_sink import RerunSink  # takes half a second

    return RerunSink(rig=view, record=record, viewer=viewer, port=port)
