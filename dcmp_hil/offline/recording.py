"""A recording in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.offline.column_names import Match
    from dcmp_hil.offline.settings import InputKind
    from dcmp_hil.offline.unwrapping import Modulus

_ROWS_MIN = 20
_VALUE_MAX = 1e6  # rad, N m, V, rad/s: beyond it a unit or a column is wrong


@dataclass(frozen=True, kw_only=True)
class ColumnOptions:
    """Names and units of the columns; None finds the name, and takes the unit from the name, the file or SI.

    A unit is spelled as usual: ``s ms us ns``, ``rad mrad deg rev counts``, ``N m``, ``mN m``, ``V mV``,
    ``rad/s deg/s rpm``. The columns of a file without names are called 1, 2, 3.
    """

    time: str | None = None
    """`none` where the file has no time worth taking; `a+b` for whole seconds and their fraction."""
    position: str | None = None
    torque: str | None = None
    """`none`, like that of `voltage`, is the same as `no_input`."""
    voltage: str | None = None
    velocity: str | None = None
    """`none` leaves a velocity that the file has out."""
    time_unit: str | None = None
    position_unit: str | None = None
    torque_unit: str | None = None
    voltage_unit: str | None = None
    velocity_unit: str | None = None
    no_input: bool = False
    """Nothing was applied: the arm swung freely."""
    prefer: InputKind | None = None
    """Which input to take where the file has both and no option names one."""
    counts_per_rev: float | None = None
    """What a position in counts is converted by."""
    period: float | None = None
    """s: the rows are evenly sampled; a time column then tells only which of them were lost."""
    modulus: Modulus = None
    """At how many of its own units the position wraps; `none`: nowhere; None finds it."""


@dataclass(frozen=True, kw_only=True)
class LoggedSignals:
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
        N m or V, shape (n,): as written in each row; 0 where nothing was applied.
    input_kind
        Which of the two it is, or `none`.
    velocity
        rad/s, shape (n,), of the device itself, NaN where it is not known; None where the file has none.
    breaks
        Rows at which a new stretch begins that nothing ties to the one before.
    left_out
        Rows of the file that are not in these columns.
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
    breaks: tuple[int, ...] = ()
    left_out: int = 0
    columns: tuple[Match, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check lengths, order and finiteness of the columns.

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
        if len(self.time) < _ROWS_MIN:
            raise ConfigError(
                f"{self.name}: {len(self.time)} rows are too few to judge an observer by; "
                f"at least {_ROWS_MIN} are needed. Record longer."
            )
        faults = [fault for name, values in given.items() if (fault := self._unbelievable(name, values))]
        if faults:
            raise ConfigError(*faults)
        stuck = np.flatnonzero(np.diff(self.time) <= 0.0)
        if len(stuck):
            raise ConfigError(
                f"{self.name}, row {stuck[0] + 2}: time does not rise from row to row. If the rows are "
                "evenly sampled, give them the times that they were taken at (read_recording does: --period)."
            )

    def begins(self, gap: float) -> NDArray[np.bool_]:
        """Return where a stretch begins, shape (n,): at the first row, a break, and behind a longer step.

        Parameters
        ----------
        gap
            s: a longer step is not bridged.
        """
        begins = np.concatenate(([True], np.diff(self.time) > gap))
        begins[list(self.breaks)] = True
        return begins

    def _unbelievable(self, name: str, values: NDArray[np.float64]) -> str:
        if name == "velocity":  # nothing depends on it
            values = np.nan_to_num(values)
        limit = np.inf if name == "time" else _VALUE_MAX
        bad = np.flatnonzero(~(np.isfinite(values) & (np.abs(values) <= limit)))
        if not len(bad):
            return ""
        row = int(bad[0])
        return (
            f"{self.name}, row {row + 1}: a {name} of {values[row]:g} (SI) is no measurement. "
            f"Check the column and its unit (--{name}, --{name}-unit)."
        )
