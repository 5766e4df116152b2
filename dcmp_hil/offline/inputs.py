"""The input column: held where it was written less often than the position, without damaged cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Column = NDArray[np.float64]

_EMPTY_CELLS_SHARE_MIN = 0.05
"""Share of empty cells from which an input was written less often than the position."""
_PULSE_ROWS_MAX = 2  # rows, one behind the other
_OUTLIER_RATIO = 20.0  # times the largest of the other rows
_LARGE_INPUT_MIN = 60.0  # V or N m: below it a short pulse can have been meant
_FEW_ROWS_SHARE = 0.001  # share of rows


def held(values: Column, cells: Sequence[str], name: str, notes: list[str]) -> Column:
    """Return the input with its empty cells filled, if there are so many that it was written less often.

    Parameters
    ----------
    values
        Shape (n,), NaN where a cell holds no number.
    cells
        The same as text.
    name
        Of the column, for `notes`, to which is added what was done.
    """
    empty = np.array([not cell for cell in cells])
    if not _EMPTY_CELLS_SHARE_MIN * len(empty) < empty.sum() < len(empty):
        return values
    last = np.maximum.accumulate(np.where(empty, 0, np.arange(len(empty))))
    notes.append(
        f'"{name}" is written in {len(empty) - int(empty.sum())} of {len(empty)} rows: held in between.'
    )
    return np.asarray(values[last], dtype=np.float64)


def undamaged(values: Column, size: float, name: str, notes: list[str]) -> Column:
    """Return the input with NaN for single numbers that no amplifier can have made, as without their point.

    Parameters
    ----------
    values
        Shape (n,), NaN where a cell holds no number.
    size
        V or N m, one of the file's unit.
    name
        Of the column, for `notes`, to which is added what was done.
    """
    amount = np.abs(size * values)
    known = np.sort(amount[np.isfinite(amount)])
    others = known[: len(known) - max(1, int(_FEW_ROWS_SHARE * len(known)))]
    if not len(others):
        return values
    far = amount > max(_LARGE_INPUT_MIN, _OUTLIER_RATIO * float(others[-1]))
    edges = np.flatnonzero(np.diff(np.concatenate(([0], far.astype(np.int8), [0]))))
    if not len(edges) or int(np.max(edges[1::2] - edges[::2])) > _PULSE_ROWS_MAX:
        return values
    count = int(far.sum())
    what = "1 number is" if count == 1 else f"{count} numbers are"
    notes.append(f'{what} far beyond all the others in "{name}", and not taken.')
    return np.where(far, np.nan, values)
