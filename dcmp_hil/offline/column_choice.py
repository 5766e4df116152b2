"""Which columns of a file are read, by the options or by their names."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.cells import is_clock, numbers
from dcmp_hil.offline.column_names import listed, match, sample_number, split_time
from dcmp_hil.offline.dialect import MAJORITY_SHARE

if TYPE_CHECKING:
    from dcmp_hil.offline.column_names import Match
    from dcmp_hil.offline.recording import ColumnOptions
    from dcmp_hil.offline.table import TextTable
    from dcmp_hil.offline.units import Quantity

NONE = "none"


class Columns(NamedTuple):
    """The columns of a CSV file that are used, by quantity.

    Parameters
    ----------
    time
        None where the rows are evenly sampled and nothing numbers them.
    fraction
        Of the second, beside a `time` in whole seconds; None otherwise.
    position, input, velocity
        The other three; None for no input, and where the file has no velocity.
    notes
        What the reader should know, one sentence each.
    """

    time: Match | None
    fraction: Match | None
    position: Match
    input: Match | None
    velocity: Match | None
    notes: tuple[str, ...]

    @property
    def all(self) -> tuple[Match, ...]:
        """Return the matches of all columns that were found."""
        columns = (self.time, self.fraction, self.position, self.input, self.velocity)
        return tuple(column for column in columns if column is not None)


def choose(table: TextTable, options: ColumnOptions) -> Columns:
    """Return the columns that are used.

    Raises
    ------
    ConfigError
        If a column that is needed cannot be found, or one is used twice.
    """
    notes: list[str] = []
    if not table.named and options.position is None:
        several = " ".join(f"--{name} {k}" for k, name in enumerate(("time", "position", "voltage"), 1))
        raise ConfigError(
            f"{table.path}: the first line holds numbers ({', '.join(table.rows[0][:4])}), not names. Say "
            f"which column is which by its number, such as {several}, or put a line with names in front, "
            "such as: time_s,position_rad,torque_Nm"
        )
    time, fraction = _time(table, options)
    position = _find("position", table, options)
    if position is None:
        raise _missing(table, "position", "")
    found = Columns(
        time, fraction, position, _input(table, options), _velocity(table, options, notes), tuple(notes)
    )
    names = [column.column for column in found.all]
    if len(set(names)) < len(names):
        raise ConfigError(
            f"{table.path}: one column is used twice ({', '.join(names)}). Give each quantity its own."
        )
    twice = [name for name in names if table.header.count(name) > 1]
    if twice:
        raise ConfigError(
            f"{table.path}: more than one column is called {listed(twice)}. Give each its own name."
        )
    return found


def _time(table: TextTable, options: ColumnOptions) -> tuple[Match | None, Match | None]:
    """Return the column of the time, and that of its fraction of a second."""
    named = options.time
    if named is not None and named.lower() == NONE and NONE not in table.header:
        if options.period is None:
            raise ConfigError("--time none: say how far apart the rows are: --period T, in seconds.")
        return None, None
    if named is not None and "+" in named and named not in table.header:
        first, _, second = named.partition("+")
        return _pair(table, first, second, None)
    pair = split_time(table.header)
    wanted = pair is not None and (named is None or named.lower() == pair[0].lower())
    if pair and wanted:
        return _two_columns(table, options, *pair)
    found = _find("time", table, options) or _unnamed_time(table)
    if found is None and options.period is None:
        raise _missing(table, "time", " Without one, say how far apart the rows are: --period T, in seconds.")
    number = sample_number(table.header) if found is None else None
    return found if number is None else match("time", table.header, number, None), None


def _unnamed_time(table: TextTable) -> Match | None:
    """Return a first column without a name as the time, as pandas writes an index of times."""
    if table.header[0] != "1" or not table.named:
        return None
    cells = table.column("1")
    values = numbers(cells, table.decimal)
    clocks = sum(map(is_clock, cells)) > MAJORITY_SHARE * len(cells)
    steps = np.diff(values[np.isfinite(values)])
    rises = len(steps) > 0 and bool((steps > 0.0).all()) and float(np.median(steps)) != 1.0
    return match("time", table.header, "1", None) if clocks or rises else None


def _two_columns(
    table: TextTable, options: ColumnOptions, first: str, second: str
) -> tuple[Match | None, Match | None]:
    """Return two columns that form the time together, or the finer one if both are the whole time."""
    if _is_pair(table, first, second):
        return _pair(table, first, second, options.time_unit)
    if options.time is not None:
        return _find("time", table, options), None
    finer = first if any("." in cell or "," in cell for cell in table.column(first)) else second
    return match("time", table.header, finer, options.time_unit, table.units), None


def _pair(table: TextTable, first: str, second: str, unit: str | None) -> tuple[Match | None, Match | None]:
    whole = match("time", table.header, first, unit or "s")
    part = match("time", table.header, second, None)
    if whole and part and part.source == "assumed":
        raise ConfigError(
            f'--time {first}+{second}: the unit of "{part.column}" is not in its name. Rename it in the '
            "first line, such as time_s and time_ns."
        )
    return whole, part


def _is_pair(table: TextTable, first: str, second: str) -> bool:
    """Whether the first column holds whole seconds and the second their fraction."""
    part = match("time", table.header, second, None)
    most = round(1.0 / part.size) if part else 0
    whole = all(cell.lstrip("+-").isdigit() for cell in table.column(first) if cell)
    return whole and all(cell.isdigit() and int(cell) < most for cell in table.column(second) if cell)


def _input(table: TextTable, options: ColumnOptions) -> Match | None:
    named = [name for name in (options.torque, options.voltage) if name is not None]
    if options.no_input or [name for name in named if name.lower() == NONE and name not in table.header]:
        if any(name.lower() != NONE for name in named):
            raise ConfigError("--no-input: an input column is named as well. Leave one of the two out.")
        return None
    if len(named) > 1:
        raise ConfigError("--torque and --voltage: a replay takes one input. Leave one of them out.")
    torque = _find("torque", table, options) if options.voltage is None else None
    voltage = _find("voltage", table, options) if options.torque is None else None
    if torque and voltage and options.prefer:
        torque, voltage = (torque, None) if options.prefer == "torque" else (None, voltage)
    if torque and voltage:
        raise ConfigError(
            f'{table.path} has a torque ("{torque.column}") and a voltage ("{voltage.column}"). '
            f'Say which one is the input: --torque "{torque.column}" or --voltage "{voltage.column}".'
        )
    found = torque or voltage
    if found is None:
        raise ConfigError(
            f"{table.path}: no column looks like torque or voltage; the header has: {_header(table)}. "
            "Name it: --torque COLUMN or --voltage COLUMN. If nothing was applied, say --no-input."
        )
    return found


def _velocity(table: TextTable, options: ColumnOptions, notes: list[str]) -> Match | None:
    """Return the column of velocity; None if it is in doubt, since it is optional."""
    if options.velocity is not None:
        if options.velocity.lower() == NONE and NONE not in table.header:
            return None
        return _find("velocity", table, options)
    try:
        return _find("velocity", table, options)
    except ConfigError as error:
        notes.append(f"No velocity of the file is taken: {error}")
        return None


def _find(quantity: Quantity, table: TextTable, options: ColumnOptions) -> Match | None:
    column, unit = getattr(options, quantity), getattr(options, f"{quantity}_unit")
    return match(quantity, table.header, column, unit, table.units)


def _missing(table: TextTable, quantity: Quantity, more: str) -> ConfigError:
    return ConfigError(
        f"{table.path}: no column looks like {quantity}; the header has: {_header(table)}. "
        f"Name it: --{quantity} COLUMN (and its unit, if it is not SI: --{quantity}-unit).{more}"
    )


def _header(table: TextTable) -> str:
    return listed(table.header)
