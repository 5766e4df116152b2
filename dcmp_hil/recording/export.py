"""A recording as CSV, Parquet, or a Rerun recording."""

from __future__ import annotations

import csv
import json
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.common.atomic_file import whole_file
from dcmp_hil.errors import ConfigError
from dcmp_hil.telemetry.rerun.rig_view import view_of
from dcmp_hil.telemetry.signals import columns, names
from dcmp_hil.values import Event

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.recording.reexecute import Reexecution
    from dcmp_hil.telemetry.block import Block

_ROW_GROUP_ROWS = 1 << 16  # rows of a row group
_REPLAYED_COLUMNS = (  # what a replay says a second time
    "position_estimate_rad",
    "velocity_estimate_rad_s",
    "disturbance_estimate_rad_s2",
    "voltage_demand_V",
)


def to_csv(run: RecordedRun, path: Path) -> None:
    """Write every signal, one row a cycle; numbers come back to the bit."""
    with _writing(path) as place, place.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(names(run.further))
        for block in run.blocks():
            _write_rows(writer, columns(block).values())


def to_parquet(run: RecordedRun, path: Path) -> None:
    """Write every signal as a column of doubles, and what the run was as metadata of the file."""
    pyarrow: Any = import_module("pyarrow")  # neither has types
    parquet: Any = import_module("pyarrow.parquet")
    said = {**run.run, "complete": str(run.complete).lower(), "missing": json.dumps(run.gaps)}
    schema = pyarrow.schema([(name, pyarrow.float64()) for name in names(run.further)], metadata=said)
    with (
        _writing(path) as place,
        place.open("wb") as file,  # given a path, pyarrow removes it where it cannot write
        parquet.ParquetWriter(file, schema) as writer,
    ):
        for block in run.blocks(_ROW_GROUP_ROWS):
            writer.write_table(pyarrow.table(columns(block), schema=schema))


def to_rrd(run: RecordedRun, path: Path) -> None:
    """Write the dashboard of the run."""
    from dcmp_hil.telemetry.rerun.sink import RerunSink

    with _writing(path) as place:
        sink = RerunSink(view_of(run.rig, run.further), place, "none")
        for part in _in_order(run):
            if isinstance(part, Event):
                sink.event(part)
            else:
                sink.block(part)
        sink.close()


def _in_order(run: RecordedRun) -> Iterator[Block | Event]:
    """Yield cycles and events as they came: what an event changes begins with the cycle of its time."""
    events = sorted(run.events, key=lambda event: event.t)
    for block in run.blocks():
        first = 0
        while events and events[0].t <= block["t"][-1]:
            end = int(np.searchsorted(block["t"], events[0].t))
            if end > first:
                yield block.with_rows(block.rows[first:end])
                first = end
            yield events.pop(0)
        if first < len(block):
            yield block.with_rows(block.rows[first:])
    yield from events


def reexecution_to_csv(
    run: RecordedRun, again: Reexecution, others: Mapping[str, Reexecution], path: Path
) -> None:
    """Write what observer and controller said then and now, one row a cycle.

    Parameters
    ----------
    run, again
        The run, and its repetition: columns ending in `_again`.
    others
        Further repetitions, by name: columns ending in `_compare1`, `_compare2` ..., in their order.
    path
        Replaced if it is there.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    wanted = ("time_s", *_REPLAYED_COLUMNS)
    endings = ("again", *(f"compare{number}" for number in range(1, len(others) + 1)))
    now = [values for one in (again, *others.values()) for values in _now(one).values()]
    with _writing(path) as place, place.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow((*wanted, *(f"{name}_{ending}" for ending in endings for name in _REPLAYED_COLUMNS)))
        first = 0
        for block in run.blocks():
            then, end = columns(block), first + len(block)
            _write_rows(writer, (*(then[name] for name in wanted), *(values[first:end] for values in now)))
            first = end


def reexecution_to_rrd(
    run: RecordedRun, again: Reexecution, others: Mapping[str, Reexecution], path: Path
) -> None:
    """Write what observer and controller said then and now as a Rerun recording, one plot a signal.

    Parameters
    ----------
    run, again
        The run, and its repetition.
    others
        Further repetitions, by the name that their lines have.
    path
        Replaced if it is there.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """
    from dcmp_hil.telemetry.rerun.series import write_series

    then = run.columns
    plots = {name: {"recorded": then[name], "again": values} for name, values in _now(again).items()}
    for label, other in others.items():
        for name, values in _now(other).items():
            plots[name][label] = values
    time = then["time_s"]
    with _writing(path) as place:
        write_series(place, "dcmp-hil replay", time - time[0], plots)


def _write_rows(writer: Any, table: Iterable[NDArray[np.float64]]) -> None:
    """Write columns as rows; a number that is none is an empty field."""
    for row in zip(*(column.tolist() for column in table), strict=True):
        writer.writerow("" if value != value else repr(value) for value in row)


def _now(again: Reexecution) -> dict[str, NDArray[np.float64]]:
    return dict(zip(_REPLAYED_COLUMNS, (*again.estimate.T, again.demand), strict=True))


@contextmanager
def _writing(path: Path) -> Iterator[Path]:
    """Yield where to write a file that appears wholly or not at all."""
    try:
        with whole_file(path) as place:
            try:
                yield place
            except (
                ConfigError,
                RuntimeError,
            ) as error:  # Rerun's; it names what takes the place of this file
                raise ConfigError(str(error).replace(str(place), str(path))) from None
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Choose a file you may write.") from None
