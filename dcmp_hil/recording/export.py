"""A recording as CSV, Parquet, or a Rerun recording."""

from __future__ import annotations

import csv
import math
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.rig_view import view_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.recording.again import Again
    from dcmp_hil.recording.reader import RecordedRun

_ROWS = 4096  # a block of a Rerun recording
_TWICE = (  # what a replay says a second time
    "position_estimate_rad",
    "velocity_estimate_rad_s",
    "disturbance_estimate_rad_s2",
    "voltage_demand_V",
)


def to_csv(run: RecordedRun, path: Path) -> None:
    """Write every signal, one row a period; numbers come back to the bit."""
    table = run.columns
    with _writing(path), path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        for row in zip(*(column.tolist() for column in table.values()), strict=True):
            writer.writerow("" if value != value else repr(value) for value in row)


def to_parquet(run: RecordedRun, path: Path) -> None:
    """Write every signal as a column of doubles, and what the run was as metadata of the file."""
    pyarrow: Any = import_module("pyarrow")  # neither has types
    parquet: Any = import_module("pyarrow.parquet")
    table = pyarrow.table(run.columns)
    with _writing(path), path.open("wb") as file:  # given a path, pyarrow removes it where it cannot write
        parquet.write_table(table.replace_schema_metadata(run.run), file)


def to_rrd(run: RecordedRun, path: Path) -> None:
    """Write the dashboard of the run."""
    from dcmp_hil.telemetry.rerun_sink import RerunSink

    with _writing(path):
        sink = RerunSink(view_of(run.rig), path, "none")
        for event in run.events:
            sink.event(event)
        for first in range(0, len(run.rows), _ROWS):
            sink.block(Block(run.rows[first : first + _ROWS], run.rig.model.values()))
        sink.close()


def again_to_csv(run: RecordedRun, again: Again, path: Path) -> None:
    """Write what observer and controller said then and now, one row a period."""
    table = {name: run.columns[name] for name in ("time_s", *_TWICE)} | {
        f"{name}_again": values for name, values in _now(again).items()
    }
    with _writing(path), path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(table)
        for row in zip(*(column.tolist() for column in table.values()), strict=True):
            writer.writerow("" if math.isnan(value) else repr(value) for value in row)


def again_to_rrd(run: RecordedRun, again: Again, path: Path) -> None:
    """Write what observer and controller said then and now as a Rerun recording, one plot a signal."""
    from dcmp_hil.telemetry.series import write_series

    plots = {name: {"recorded": run.columns[name], "again": values} for name, values in _now(again).items()}
    time = run.columns["time_s"]
    with _writing(path):
        write_series(path, "dcmp-hil replay", time - time[0], plots)


def _now(again: Again) -> dict[str, NDArray[np.float64]]:
    return dict(zip(_TWICE, (*again.estimate.T, again.demand), strict=True))


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Choose a file you may write.") from None
    except RuntimeError as error:  # Rerun's, of a disk that is full
        raise ConfigError(f"{path}: {error}") from None
