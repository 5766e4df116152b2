"""Plots that are already there as columns, written as a recording."""

from __future__ import annotations

import threading
from queue import Empty, Queue
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.rerun.blueprint import TIMELINE, opened, plot
from dcmp_hil.telemetry.rerun.stream_worker import THREAD
from dcmp_hil.telemetry.rerun.text_stream import TextStream
from dcmp_hil.telemetry.signals import (
    ERROR_RGB,
    ESTIMATE_RGB,
    FAINT_RGB,
    REFERENCE_RGB,
    TRUE_RGB,
    VOLTAGE_RGB,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

_STYLES = {
    "measured": (TRUE_RGB, 4.5),
    "true": (TRUE_RGB, 4.5),
    "given": (FAINT_RGB, 1.0),
    "estimate": (ESTIMATE_RGB, 2.8),
    "reference": (REFERENCE_RGB, 1.2),
    "error": (ERROR_RGB, 1.2),
    "applied": (VOLTAGE_RGB, 1.6),
}
_OTHER_COLOURS = ((190, 90, 200), (90, 200, 200), (220, 210, 90), FAINT_RGB)
_FLUSH_TIMEOUT_S = 30.0  # s
_PLOT_TIMEOUT_S = 40.0  # s for one plot


def write_series(
    path: Path, application: str, time: NDArray[np.float64], plots: dict[str, dict[str, NDArray[np.float64]]]
) -> None:
    """Write columns as an .rrd file that opens as one plot above the other.

    Parameters
    ----------
    path
        Written anew.
    application
        Recordings of the same application share the viewer's layout.
    time
        s, shape (n,).
    plots
        Entity path with unit, such as ``joint/position_rad``, to the lines of the plot by name, each of
        shape (n,). Lines that are all NaN are left out.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    try:
        path.open("wb").close()
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Choose a file you may write.") from None
    layout = opened(rrb.Vertical(*(plot(name) for name in plots)), follow=False)
    stream = TextStream(application)
    times = [rr.TimeColumn(TIMELINE, duration=np.rint(time * 1e9).astype("timedelta64[ns]"))]

    def steps() -> Iterator[None]:
        stream.set_sinks(rr.FileSink(path), default_blueprint=layout)
        stream.send_blueprint(layout)
        stream.send_recording_name(path.stem)
        for name, lines in plots.items():
            _send(stream, name, times, {k: v for k, v in lines.items() if not np.isnan(v).all()})
            yield
        stream.flush(timeout_sec=_FLUSH_TIMEOUT_S)
        yield
        stream.disconnect()

    problem = _error_of(steps())
    if problem is not None:
        raise ConfigError(f"{path}: {problem}. Free some space, or choose another disk.")


def _error_of(steps: Iterator[None]) -> Exception | None:
    """Run steps on a thread, as Rerun may never return on a full disk; return their error."""
    answers: Queue[Exception | bool] = Queue()

    def take() -> None:
        try:
            for _ in steps:
                answers.put(True)
        except Exception as error:  # noqa: BLE001 - told to the caller
            answers.put(error)
            threading.Event().wait()  # to leave would end the stream, which waits for the disk for ever
        answers.put(False)

    threading.Thread(target=take, name=THREAD, daemon=True).start()
    try:
        while (answer := answers.get(timeout=_PLOT_TIMEOUT_S)) is True:
            pass
    except Empty:
        return TimeoutError("the disk takes nothing any more")
    return answer if isinstance(answer, Exception) else None


def _send(
    stream: rr.RecordingStream, path: str, times: list[rr.TimeColumn], lines: dict[str, NDArray[np.float64]]
) -> None:
    if not lines:
        return
    styles = [
        _STYLES.get(name, (_OTHER_COLOURS[k % len(_OTHER_COLOURS)], 1.2)) for k, name in enumerate(lines)
    ]
    look = rr.SeriesLines(
        names=list(lines),
        colors=[colour for colour, _ in styles],
        widths=[width for _, width in styles],
        aggregation_policy="MinMax",
    )
    stream.log(path, look, static=True)
    values = np.stack(list(lines.values()), axis=1)
    stream.send_columns(path, times, rr.Scalars.columns(scalars=values))
