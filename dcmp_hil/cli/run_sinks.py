"""The sinks of a run, made in the telemetry process.

Apart from the run itself, whose imports that process would wait for half a second.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

from dcmp_hil.cli import console, streams
from dcmp_hil.cli.status_line import StatusLine
from dcmp_hil.platform import process_log

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.dispatcher import Sink
    from dcmp_hil.telemetry.rerun.rig_view import RigView
    from dcmp_hil.telemetry.rerun.sink import Viewer
    from dcmp_hil.values import Event


def status_line(period: float) -> Sink:
    """Return the status line of a run whose samples come every `period` (s)."""
    streams.guard()
    use_terminal()
    return StatusLine(console.err, period)


def recording(path: Path, period: float, run: dict[str, str], rig: str) -> Sink:
    """Return the run's own recording."""
    from dcmp_hil.recording.writer import RecordingSink

    return RecordingSink(path, period, run, rig)


def dashboard(view: RigView, record: Path | None, viewer: Viewer, port: int) -> Sink:
    """Return the Rerun dashboard, its recording, or both; say where a viewer finds it."""
    from dcmp_hil.cli.viewer import watched
    from dcmp_hil.telemetry.rerun.sink import RerunSink  # takes half a second

    use_terminal()
    return watched(RerunSink(view, record, viewer, port=port, spare=True, optimised=True), viewer)


def dashboard_replacing(view: RigView, record: Path, viewer: Viewer, port: int) -> Sink:
    """Return a dashboard whose recording takes the place of what is at `record` with the first period."""
    from dcmp_hil.common.atomic_file import place_beside

    beside = place_beside(record)
    if beside is None:
        return dashboard(view, record, viewer, port)
    return _Replacing(lambda: dashboard(view, beside, viewer, port), beside, record)


class _Replacing:
    """A sink whose file gets its name with the first period: a run that never begins replaces nothing.

    Parameters
    ----------
    make
        Makes the sink that writes.
    beside, target
        Where it writes to, and what that is called from the first period on.
    """

    def __init__(self, make: Callable[[], Sink], beside: Path, target: Path) -> None:
        self._beside, self._target = beside, target
        self._began = False
        try:
            self._sink = make()
        except BaseException:
            beside.unlink(missing_ok=True)
            raise

    @property
    def warnings(self) -> Sequence[str]:
        """Messages about parts that the sink works without."""
        warnings: Sequence[str] = getattr(self._sink, "warnings", ())
        return warnings

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        if not self._began and len(block):
            self._began = True
            with suppress(FileNotFoundError):  # there is no room for one, and a warning has said so
                self._beside.replace(self._target)
        self._sink.block(block)

    def event(self, event: Event) -> None:
        """Process an event."""
        self._sink.event(event)

    def close(self) -> None:
        """Finish; without a period there is no file."""
        try:
            self._sink.close()
        finally:
            if not self._began:
                self._beside.unlink(missing_ok=True)


def use_terminal() -> None:
    """Print on the terminal, in the telemetry process, whose own standard error is a log."""
    number = process_log.terminal()
    if number is not None and console.err.file.fileno() != number:
        console.err = console.SafeConsole(file=streams.text_on(number), soft_wrap=True)
