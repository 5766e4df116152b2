"""From a text file to a recording: read what can be read, leave out what cannot, and say so."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.common.number_range import number
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.cells import clock_times, is_clock, numbers
from dcmp_hil.offline.column_choice import choose
from dcmp_hil.offline.inputs import held, undamaged
from dcmp_hil.offline.recording import ColumnOptions, LoggedSignals
from dcmp_hil.offline.table import read_table
from dcmp_hil.offline.timestamps import Stamps, epoch_unit, rising
from dcmp_hil.offline.units import COUNTS, known_unit
from dcmp_hil.offline.unwrapping import Motion, continuous, moduli

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from dcmp_hil.offline.column_choice import Columns
    from dcmp_hil.offline.column_names import Match
    from dcmp_hil.offline.table import TextTable

    Column = NDArray[np.float64]

_TURN_RAD = 2.0 * np.pi
_SHOWN_FAULTS_MAX = 5
_MAJORITY_SHARE = 0.5
_VALUE_MAX = 1e12  # in any unit: beyond it a number is an overflow
_WHOLE_NUMBER_SPAN_MAX_RAD = 50.0  # a span of whole numbers that no recording in rad has


class _Values(NamedTuple):
    """Columns as numbers, in the units of the file; NaN where a cell holds none."""

    time: Column | None
    position: Column
    input: Column | None
    velocity: Column | None
    size: float  # s, of one unit of `time`
    period: float | None  # s, of evenly sampled rows


def read_recording(path: Path, options: ColumnOptions | None = None) -> LoggedSignals:
    """Read a recording with columns of time, position and torque or voltage, perhaps velocity.

    Text around the rows, rows without a number and rows that the file holds twice are left out. Counters
    that wrap are continued, time and position alike. All of that is told in `LoggedSignals.notes`.

    Parameters
    ----------
    path
        The file; see `dcmp_hil.offline.table.read_table`.
    options
        Names, units and what else the file does not tell.

    Raises
    ------
    ConfigError
        If the file is missing or no text, a column cannot be found, a unit is unknown, or a figure would be
        in doubt: the stamps do not tell the time, or the position jumps as no arm can move.
    """
    options = options or ColumnOptions()
    table = read_table(path)
    columns = choose(table, options)
    notes = [*table.notes, *columns.notes]
    values, columns = _numbers(table, columns, options, notes)
    known = _known(table, columns, values, notes)
    stamps = _stamps(table, columns, values, known, options)
    rows = known[stamps.rows]
    position, columns, motion = _position(columns, values.position[rows], stamps, options)
    keep = motion.keep
    begins = sorted({*stamps.breaks, *motion.breaks})
    places = np.cumsum(keep) - 1  # of each row among those kept
    kept_breaks = {int(places[k]) + (0 if keep[k] else 1) for k in begins} - {0, int(keep.sum())}
    velocity = columns.velocity
    given = (
        None if values.velocity is None or velocity is None else values.velocity[rows][keep] * velocity.size
    )
    if given is not None and not np.isfinite(given).any():
        notes.append(
            f'No velocity of the file is taken: "{velocity.column if velocity else ""}" holds no number.'
        )
        given = None
    applied = columns.input
    return LoggedSignals(
        name=path.stem,
        time=stamps.time[keep],
        position=position[keep],
        input=np.zeros(int(keep.sum()))
        if applied is None or values.input is None
        else values.input[rows][keep] * applied.size,
        input_kind="none" if applied is None else "torque" if applied.quantity == "torque" else "voltage",
        velocity=given,
        breaks=tuple(sorted(kept_breaks)),
        left_out=len(table.rows) - int(keep.sum()),
        columns=columns.all,
        notes=(*notes, *stamps.notes, *motion.notes, *_applied(columns)),
    )


def _numbers(
    table: TextTable, columns: Columns, options: ColumnOptions, notes: list[str]
) -> tuple[_Values, Columns]:
    position = _column(table, columns.position)
    applied = None if columns.input is None else _column(table, columns.input)
    velocity = None if columns.velocity is None else _column(table, columns.velocity)
    if columns.input is not None and applied is not None:
        name = columns.input.column
        applied = held(applied, table.column(name), name, notes)
        applied = undamaged(applied, columns.input.size, name, notes)
    time, size, period = None, 1.0, options.period
    if columns.time is not None:
        time, columns, period = _time(table, columns, options, notes)
        size = columns.time.size if columns.time else 1.0
    return _Values(time, position, applied, velocity, size, period), columns


def _column(table: TextTable, column: Match) -> Column:
    values = numbers(table.column(column.column), table.decimal)
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(values) < _VALUE_MAX, values, np.nan)


def _time(
    table: TextTable, columns: Columns, options: ColumnOptions, notes: list[str]
) -> tuple[Column, Columns, float | None]:
    """Return the stamps, the columns with what they turned out to be, and the period of even sampling."""
    column = columns.time
    assert column is not None  # noqa: S101 - the caller has looked
    cells = table.column(column.column)
    if sum(map(is_clock, cells)) > _MAJORITY_SHARE * len(cells):
        found = column._replace(unit="s", size=1.0, source="values")
        return clock_times(cells), columns._replace(time=found), options.period
    stamps = numbers(cells, table.decimal)
    if columns.fraction is not None:
        parts = numbers(table.column(columns.fraction.column), table.decimal)
        start = stamps[np.isfinite(stamps)][:1]
        whole = stamps - (start[0] if len(start) else 0.0)
        return whole + parts * columns.fraction.size, columns, options.period
    known = stamps[np.isfinite(stamps)]
    if column.source != "assumed" or not len(known):
        return stamps, columns, options.period
    epoch = epoch_unit(known)
    if epoch:
        unit, size = epoch
        return (
            stamps,
            columns._replace(time=column._replace(unit=unit, size=size, source="values")),
            options.period,
        )
    counted = np.median(np.diff(known)) == 1.0 if len(known) > 1 else False
    if counted and bool((known == np.round(known)).all()):
        if options.period is None:
            raise ConfigError(
                f'{table.path}: "{column.column}" rises by one from row to row, so it numbers the samples. '
                "Say how far apart they are: --period T, in seconds (or --time-unit, if it is a time)."
            )
        notes.append(f'"{column.column}" numbers the samples, {number(options.period)} s apart (--period).')
        numbered = column._replace(unit="samples", size=options.period, source="values")
        return stamps, columns._replace(time=numbered), None
    return stamps, columns, options.period


def _known(table: TextTable, columns: Columns, values: _Values, notes: list[str]) -> NDArray[np.intp]:
    """Return the rows that hold every number that is needed."""
    needed = [(columns.time, values.time), (columns.position, values.position), (columns.input, values.input)]
    missing = {
        column.column: ~np.isfinite(numbers_)
        for column, numbers_ in needed
        if column is not None and numbers_ is not None
    }
    bad = np.any(list(missing.values()), axis=0)
    count = int(bad.sum())
    if not count:
        return np.arange(len(bad))
    faults = [
        f"{table.path}, row {row + 1} (line {table.lines[row]}), column {name}: "
        f"{_shown(table.column(name)[row])} is no finite number"
        for row in np.flatnonzero(bad)[:_SHOWN_FAULTS_MAX].tolist()
        for name, where in missing.items()
        if where[row]
    ]
    garbage = sum(
        bool(table.rows[row][table.header.index(name)])
        for name, where in missing.items()
        for row in np.flatnonzero(where).tolist()
    )
    if count == len(bad) or garbage > _MAJORITY_SHARE * len(bad):
        more = [f"... in {count} of {len(bad)} rows"] if count > 1 else []
        raise ConfigError(
            *faults[:_SHOWN_FAULTS_MAX],
            *more,
            "Check the columns: --time, --position, --torque or --voltage.",
        )
    said = ", ".join(f"{name} ({int(where.sum())})" for name, where in missing.items() if where.any())
    notes.append(
        f"{count} {'row' if count == 1 else 'rows'} left out without a number in {said}; the first is line "
        f"{table.lines[int(np.flatnonzero(bad)[0])]}."
    )
    return np.flatnonzero(~bad)


def _stamps(
    table: TextTable, columns: Columns, values: _Values, known: NDArray[np.intp], options: ColumnOptions
) -> Stamps:
    if values.time is None or columns.time is None:
        period = options.period or math.nan
        said = f"Evenly sampled, {number(period)} s (--period); the file's own time, if any, does not count."
        # A row that was left out is a step that is longer.
        return Stamps(period * known.astype(np.float64), np.arange(len(known)), (), (said,))
    rows = [table.rows[row] for row in known.tolist()]
    copies = np.array([False, *(after == before for before, after in pairwise(rows))])
    name = f'{table.path}, column "{columns.time.column}"'
    if len(known) < 2:  # noqa: PLR2004 - no step
        return Stamps(values.size * values.time[known], np.arange(len(known)), (), ())
    return rising(values.time[known], values.size, copies, values.period, name)


def _position(
    columns: Columns, raw: Column, stamps: Stamps, options: ColumnOptions
) -> tuple[Column, Columns, Motion]:
    """Return the position in rad, the columns with its unit, and what became of its wraps."""
    column = columns.position
    notes: tuple[str, ...] = ()
    if column.source == "assumed":
        column, notes = _guessed(column, raw, options)
    size = _size(column, options)
    motion = continuous(
        raw,
        stamps.time,
        size,
        begins=stamps.breaks,
        modulus=options.modulus,
        known=moduli(column.unit, size, options.counts_per_rev),
    )
    found = columns._replace(position=column)
    return motion.position * size, found, motion._replace(notes=(*notes, *motion.notes))


def _guessed(column: Match, raw: Column, options: ColumnOptions) -> tuple[Match, tuple[str, ...]]:
    """Return the unit of a position without one in its name, by its values: rad if possible."""
    if len(raw) and (raw == np.round(raw)).all() and np.ptp(raw) > _WHOLE_NUMBER_SPAN_MAX_RAD:
        if options.counts_per_rev is None:
            raise ConfigError(
                f'The position "{column.column}" holds whole numbers, which are no radians. Say their unit: '
                "--position-unit counts (with --counts-per-rev N), or deg."
            )
        said = f'"{column.column}" holds whole numbers: taken as counts. --position-unit overrides it.'
        return column._replace(unit=COUNTS, size=math.nan, source="values"), (said,)
    jumps = np.abs(np.diff(raw))
    jumps = jumps[jumps > 180.0]  # noqa: PLR2004 - half a turn
    if len(jumps) and np.ptp(raw) <= 360.0 and len(jumps) < 0.2 * len(raw):  # noqa: PLR2004 - a turn
        unit, size = known_unit("position", "deg")
        said = f'"{column.column}" jumps by about 360: taken as degrees. --position-unit overrides it.'
        return column._replace(unit=unit, size=size, source="values"), (said,)
    return column, ()


def _size(column: Match, options: ColumnOptions) -> float:
    if column.unit != COUNTS:
        return column.size
    if options.counts_per_rev is None:
        raise ConfigError(
            f'The position "{column.column}" is in counts. Say how many make a turn: --counts-per-rev N.'
        )
    return _TURN_RAD / options.counts_per_rev


def _applied(columns: Columns) -> tuple[str, ...]:
    column = columns.input
    if column is None or "applied" not in column.column.lower():
        return ()
    said = f'"{column.column}" sounds like the input of the period that ended, as dcmp-hil records it'
    return (f"{said}: that is --input-at end.",)


def _shown(field: str) -> str:
    longest = 40
    if not field:
        return "nothing"
    return repr(field if len(field) <= longest else field[:longest] + "...")
