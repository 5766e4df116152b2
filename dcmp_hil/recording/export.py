"""A recording as CSV, Parquet, or a Rerun recording."""

from __future__ import annotations

import csv
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.rig_view import view_of

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from dcmp_hil.recording.reader import RecordedRun

_ROWS = 4096  # a block of a Rerun recording


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
    with _writing(path):
        table = pyarrow.table(run.columns)
        parquet.write_table(table.replace_schema_metadata(run.run), path)


def to_rrd(run: RecordedRun, path: Path) -> None:
    """Write the dashboard of the run."""
    from dcmp_hil.telemetry.rerun_sink import RerunSink

    sink = RerunSink(view_of(run.rig), path, "none")
    for event in run.events:
        sink.event(event)
    for first in range(0, len(run.rows), _ROWS):
        sink.block(Block(run.rows[first : first + _ROWS], run.rig.model.values()))
    sink.close()


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Choose a file you may write.") from None
