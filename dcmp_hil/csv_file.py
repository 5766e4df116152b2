"""Reading CSV files of numbers, with messages that name file, line and remedy."""

from __future__ import annotations

import csv
import math
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

_MOST_FAULTS = 5  # named one by one; the rest are counted


def read_columns(path: Path, wanted: Sequence[str], *, time: str = "") -> dict[str, NDArray[np.float64]]:
    """Read named columns of a CSV file with a header line.

    Parameters
    ----------
    path
        The file, UTF-8, comma separated.
    wanted
        Names of the columns to read; all must be there and hold finite numbers.
    time
        Which of them must rise from row to row; the first one unless given.

    Returns
    -------
    dict
        Name to array of shape (rows,).

    Raises
    ------
    ConfigError
        If the file is missing, malformed, has a value that is no finite number, or its time does not rise.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            header, rows = _split(csv.reader(file, strict=True))
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Check the path and its permissions.") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ConfigError(f"{path}: not a CSV file ({error}). Save it as comma-separated UTF-8 text.") from None
    columns = _numbers(path, header, rows, wanted)
    _check_rising(path, columns[time or wanted[0]], time or wanted[0])
    return columns


def _split(lines: Iterable[list[str]]) -> tuple[list[str], list[list[str]]]:
    iterator = iter(lines)
    header = [name.strip() for name in next(iterator, [])]
    return header, [row for row in iterator if row]


def _numbers(
    path: Path, header: list[str], rows: list[list[str]], wanted: Sequence[str]
) -> dict[str, NDArray[np.float64]]:
    missing = [name for name in wanted if name not in header]
    if missing:
        raise ConfigError(
            f"{path}: no column {', '.join(missing)}; the header has: {', '.join(header) or 'nothing'}. "
            "Name the columns in the first line, or map them by options."
        )
    if not rows:
        raise ConfigError(f"{path}: a header and no rows. Record something first.")
    picked = [header.index(name) for name in wanted]
    values = np.full((len(rows), len(wanted)), math.nan)
    faults: list[str] = []
    for number, row in enumerate(rows):
        for place, index in enumerate(picked):
            text = row[index].strip() if index < len(row) else ""
            value = _finite(text)
            if value is None:
                faults.append(f"{path}, row {number + 1}, column {wanted[place]}: {text or 'nothing'!r} is no finite number")
            else:
                values[number, place] = value
    if faults:
        more = [f"... and {len(faults) - _MOST_FAULTS} more"] if len(faults) > _MOST_FAULTS else []
        raise ConfigError(*faults[:_MOST_FAULTS], *more, "Mend or remove those rows; a lost sample may simply be left out.")
    return {name: values[:, place].copy() for place, name in enumerate(wanted)}


def _finite(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _check_rising(path: Path, time: NDArray[np.float64], name: str) -> None:
    stuck = np.flatnonzero(np.diff(time) <= 0.0)
    if len(stuck):
        k = int(stuck[0])
        raise ConfigError(
            f"{path}, row {k + 2}: {name} goes from {time[k]:.9g} to {time[k + 1]:.9g}; time must rise from row to row. "
            "Sort the rows, or remove the repeated ones."
        )
