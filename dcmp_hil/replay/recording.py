"""A recording in SI units, read from a CSV file whose columns and units are found or told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.csv_file import pick_columns, read_text
from dcmp_hil.errors import ConfigError
from dcmp_hil.replay.names import match
from dcmp_hil.replay.units import COUNTS

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from dcmp_hil.csv_file import Text
    from dcmp_hil.replay.names import Match
    from dcmp_hil.replay.settings import InputKind
    from dcmp_hil.replay.units import Quantity

_FEWEST_ROWS = 20
_LARGEST = 1e6  # rad, N m, V, rad/s: beyond it a unit or a column is wrong
_TURN = 2.0 * np.pi
_NEARLY = 0.1  # turns


@dataclass(frozen=True, kw_only=True)
class ColumnOptions:
    """Names and units of the columns; None finds the name, and takes the unit from the name or SI.

    A unit is spelled as usual: ``s ms us ns``, ``rad mrad deg rev counts``, ``N m``, ``mN m``, ``V mV``,
    ``rad/s deg/s rpm``.
    """

    time: str | None = None
    position: str | None = None
    torque: str | None = None
    voltage: str | None = None
    velocity: str | None = None
    time_unit: str | None = None
    position_unit: str | None = None
    torque_unit: str | None = None
    voltage_unit: str | None = None
    velocity_unit: str | None = None
    prefer: InputKind | None = None
    """Which input to take where the file has both and no option names one."""
    counts_per_rev: float | None = None
    """What a position in counts is converted by."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Columns of equal length, in SI units.

    Parameters
    ----------
    name
        Of the file, without folder and suffix.
    time
        s, shape (n,), rising.
    position
        rad, shape (n,), unwrapped; 0 = hanging at rest.
    input
        N m or V, shape (n,): as written in each row.
    input_kind
        Which of the two it is.
    velocity
        rad/s, shape (n,), of the device itself; None where the file has none.
    columns
        What was read from where, in which unit.
    notes
        What else the reader should know, one sentence each.
    """

    name: str
    time: NDArray[np.float64]
    position: NDArray[np.float64]
    input: NDArray[np.float64]
    input_kind: InputKind
    velocity: NDArray[np.float64] | None = None
    columns: tuple[Match, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check what every later step relies on.

        Raises
        ------
        ConfigError
            If there are too few rows, their numbers differ, one is not finite or beyond belief, or time does
            not rise.
        """
        given = {"time": self.time, "position": self.position, self.input_kind: self.input}
        if self.velocity is not None:
            given["velocity"] = self.velocity
        if len({len(values) for values in given.values()}) > 1:
            raise ConfigError(f"{self.name}: columns of different lengths. Give each one value a row.")
        if len(self.time) < _FEWEST_ROWS:
            raise ConfigError(
                f"{self.name}: {len(self.time)} rows are too few to judge an observer by; "
                f"at least {_FEWEST_ROWS} are needed. Record longer."
            )
        faults = [fault for name, values in given.items() if (fault := self._unbelievable(name, values))]
        if faults:
            raise ConfigError(*faults)
        stuck = np.flatnonzero(np.diff(self.time) <= 0.0)
        if len(stuck):
            raise ConfigError(
                f"{self.name}, row {stuck[0] + 2}: time does not rise. Sort the rows or remove repeated ones."
            )

    def _unbelievable(self, name: str, values: NDArray[np.float64]) -> str:
        limit = np.inf if name == "time" else _LARGEST
        bad = np.flatnonzero(~(np.isfinite(values) & (np.abs(values) <= limit)))
        if not len(bad):
            return ""
        row = int(bad[0])
        return (
            f"{self.name}, row {row + 1}: a {name} of {values[row]:g} (SI) is no measurement. "
            f"Check the column and its unit (--{name}, --{name}-unit)."
        )


def read_recording(path: Path, options: ColumnOptions | None = None) -> Recording:
    """Read a CSV recording with columns of time, position and torque or voltage, perhaps velocity.

    Positions that jump by a whole turn between two rows are unwrapped.

    Parameters
    ----------
    path
        The file, with a header line; see `dcmp_hil.csv_file.read_columns`.
    options
        Names and units, as far as the names in the file do not tell.

    Raises
    ------
    ConfigError
        If the file is missing or malformed, a value is no finite number, time does not rise, a column cannot
        be found, or a unit is unknown.
    """
    options = options or ColumnOptions()
    text = read_text(path)
    time = _required("time", text, options)
    position = _required("position", text, options)
    torque_or_voltage = _input(text, options)
    velocity = match("velocity", text.header, options.velocity, options.velocity_unit)
    found = [column for column in (time, position, torque_or_voltage, velocity) if column]
    names = [column.column for column in found]
    if len(set(names)) < len(names):
        raise ConfigError(
            f"{path}: one column is used twice ({', '.join(names)}). Give each quantity its own."
        )
    values = pick_columns(text, names, time=time.column)
    si = {column.quantity: values[column.column] * _size(column, options) for column in found}
    unwrapped, turns = _unwrap(si["position"])
    return Recording(
        name=path.stem,
        time=si["time"],
        position=unwrapped,
        input=si[torque_or_voltage.quantity],
        input_kind="torque" if torque_or_voltage.quantity == "torque" else "voltage",
        velocity=si.get("velocity"),
        columns=tuple(found),
        notes=tuple(_notes(torque_or_voltage, turns)),
    )


def _required(quantity: Quantity, text: Text, options: ColumnOptions) -> Match:
    found = _find(quantity, text.header, options)
    if found is None:
        raise ConfigError(
            f"{text.path}: no column looks like {quantity}; the header has: {', '.join(text.header)}. "
            f"Name it: --{quantity} COLUMN (and its unit, if it is not SI: --{quantity}-unit)."
        )
    return found


def _input(text: Text, options: ColumnOptions) -> Match:
    if options.torque is not None and options.voltage is not None:
        raise ConfigError("--torque and --voltage: a replay takes one input. Leave one of them out.")
    torque = _find("torque", text.header, options) if options.voltage is None else None
    voltage = _find("voltage", text.header, options) if options.torque is None else None
    if torque and voltage and options.prefer:
        torque, voltage = (torque, None) if options.prefer == "torque" else (None, voltage)
    if torque and voltage:
        raise ConfigError(
            f'{text.path} has a torque ("{torque.column}") and a voltage ("{voltage.column}"). '
            f'Say which one is the input: --torque "{torque.column}" or --voltage "{voltage.column}".'
        )
    found = torque or voltage
    if found is None:
        raise ConfigError(
            f"{text.path}: no column looks like torque or voltage; the header has: {', '.join(text.header)}. "
            "Name it: --torque COLUMN or --voltage COLUMN."
        )
    return found


def _find(quantity: Quantity, header: Sequence[str], options: ColumnOptions) -> Match | None:
    return match(quantity, header, getattr(options, quantity), getattr(options, f"{quantity}_unit"))


def _size(column: Match, options: ColumnOptions) -> float:
    if column.unit != COUNTS:
        return column.size
    if options.counts_per_rev is None:
        raise ConfigError(
            f'The position "{column.column}" is in counts. Say how many make a turn: --counts-per-rev N.'
        )
    return _TURN / options.counts_per_rev


def _unwrap(position: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Undo jumps of a turn, and count them: no arm makes nine tenths of a turn between two rows."""
    jumps = np.diff(position) / _TURN
    turns = np.where(np.abs(np.abs(jumps) - 1.0) < _NEARLY, np.sign(jumps), 0.0)
    places = int(np.count_nonzero(turns))
    return (position - _TURN * np.concatenate(([0.0], np.cumsum(turns))) if places else position), places


def _notes(column: Match, turns: int) -> list[str]:
    notes = []
    if turns:
        notes.append(f"The position jumps by a turn in {turns} places: unwrapped.")
    if "applied" in column.column.lower():
        notes.append(
            f'"{column.column}" sounds like the input of the period that ended, as dcmp-hil records it: '
            "that is --input-at end."
        )
    return notes
