"""Reading CSV files of numbers, with messages that name file, line and remedy."""

from __future__ import annotations

import csv
import math
from typing import TYPE_CHECKING, NamedTuple, TextIO

import numpy as np

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

_MOST_FAULTS = 5  # named one by one; the rest are counted
_DELIMITERS = ",;\t"


class Text(NamedTuple):
    """A CSV file as text, before anybody knows which of its columns matter.

    Parameters
    ----------
    path
        Where it came from.
    header
        Names of the columns, without the spaces around them.
    rows
        Fields of each row that is neither empty nor a comment.
    lines
        Line of the file that each row ends on, from 1.
    """

    path: Path
    header: list[str]
    rows: list[list[str]]
    lines: list[int]

    def place(self, row: int) -> str:
        """Say where a row (from 0) is to be found."""
        return f"{self.path}, row {row + 1} (line {self.lines[row]})"


def read_columns(path: Path, wanted: Sequence[str], *, time: str = "") -> dict[str, NDArray[np.float64]]:
    """Read named columns of a CSV file with a header line.

    Parameters
    ----------
    path
        The file: UTF-8, fields separated by comma, semicolon or tab; lines that start with # are comments,
        and so is a # in front of the header.
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
    return pick_columns(read_text(path), wanted, time=time)


def read_text(path: Path) -> Text:
    """Read a CSV file, header line first, without looking at its values.

    Parameters
    ----------
    path
        The file, as for `read_columns`.

    Raises
    ------
    ConfigError
        If the file is missing, no text, no CSV, or has no header.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            header, rows, lines = _split(file)
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Check the path and its permissions.") from None
    except (ValueError, csv.Error) as error:  # no UTF-8, a NUL in the path, an open quote
        raise ConfigError(f"{path}: not a CSV file ({error}). Save it as comma-separated UTF-8 text.") from None
    if not any(header):
        raise ConfigError(f"{path}: empty, or its first line is. Name the columns in the first line.")
    if all(_finite(name) is not None for name in header):
        raise ConfigError(
            f"{path}: the first line holds numbers ({', '.join(header[:4])}), not names. "
            "Put a line with the names of the columns in front, such as: time_s,position_rad,torque_Nm"
        )
    return Text(path, header, rows, lines)


def pick_columns(text: Text, wanted: Sequence[str], *, time: str = "") -> dict[str, NDArray[np.float64]]:
    """Turn named columns of a file into numbers.

    Parameters
    ----------
    text
        What `read_text` returned.
    wanted, time
        As for `read_columns`.

    Returns
    -------
    dict
        Name to array of shape (rows,).

    Raises
    ------
    ConfigError
        As for `read_columns`, except a file that cannot be read.
    """
    columns = _numbers(text, wanted)
    _check_rising(text, columns[time or wanted[0]], time or wanted[0])
    return columns


def _split(file: TextIO) -> tuple[list[str], list[list[str]], list[int]]:
    first = file.readline()
    while first and not first.strip("\ufeff \t\r\n"):
        first = file.readline()
    delimiter = max(_DELIMITERS, key=first.count)  # the comma where there is none
    header = next(csv.reader([first.lstrip("# \t")], delimiter=delimiter, strict=True), [])
    before = 1  # blank lines in front of the header are rare enough not to be counted
    reader = csv.reader(file, delimiter=delimiter, strict=True)
    kept = [(row, reader.line_num + before) for row in _worth_keeping(reader)]
    return [name.strip() for name in header], [row for row, _ in kept], [line for _, line in kept]


def _worth_keeping(rows: Iterator[list[str]]) -> Iterator[list[str]]:
    return (row for row in rows if any(field.strip() for field in row) and not row[0].startswith("#"))


def _numbers(text: Text, wanted: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    path, header = text.path, text.header
    missing = [name for name in wanted if name not in header]
    if missing:
        raise ConfigError(
            f"{path}: no column {', '.join(missing)}; the header has: {', '.join(header)}. "
            "Name the columns in the first line, or map them by options."
        )
    twice = [name for name in wanted if header.count(name) > 1]
    if twice:
        raise ConfigError(f"{path}: more than one column is called {', '.join(twice)}. Give each its own name.")
    if not text.rows:
        raise ConfigError(f"{path}: a header and no rows. Record something first.")
    picked = [header.index(name) for name in wanted]
    values = np.full((len(text.rows), len(wanted)), math.nan)
    faults: list[str] = []
    for number, row in enumerate(text.rows):
        if len(row) > len(header) and any(field.strip() for field in row[len(header) :]):
            faults.append(
                f"{text.place(number)}: {len(row)} fields, but the header names {len(header)} columns "
                "(a decimal comma, perhaps; write a point)"
            )
            continue
        for place, index in enumerate(picked):
            field = row[index].strip() if index < len(row) else ""
            value = _finite(field)
            if value is None:
                faults.append(
                    f"{text.place(number)}, column {wanted[place]}: {_shown(field)} is no finite number"
                )
            else:
                values[number, place] = value
    if faults:
        more = [f"... and {len(faults) - _MOST_FAULTS} more"] if len(faults) > _MOST_FAULTS else []
        raise ConfigError(*faults[:_MOST_FAULTS], *more, "Mend or remove those rows; a lost sample may simply be left out.")
    return {name: values[:, place].copy() for place, name in enumerate(wanted)}


def _shown(field: str) -> str:
    return repr(field if len(field) <= 40 else field[:37] + "...") if field else "nothing"


def _finite(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _check_rising(text: Text, time: NDArray[np.float64], name: str) -> None:
    stuck = np.flatnonzero(np.diff(time) <= 0.0)
    if len(stuck):
        k = int(stuck[0])
        raise ConfigError(
            f"{text.place(k + 1)}: {name} goes from {time[k]:.9g} to {time[k + 1]:.9g}; time must rise from row to "
            "row. Sort the rows, or remove the repeated ones."
        )
