"""Reading CSV files of numbers, with messages that name file, line and remedy."""

from __future__ import annotations

import csv
import io
import math
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple, TextIO

import numpy as np

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

_NAMED_FAULTS_MAX = 5  # named one by one; the rest are counted
_SHOWN_CHARS_MAX = 40  # characters of a field
_DELIMITERS = ",;\t"
_FILE_MAX_MIB = 16  # a reference has a row a corner, not a row a cycle


class Text(NamedTuple):
    """A CSV file as text, before it is known which of its columns matter.

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
        """Return the place of a row (from 0) for a message."""
        return f"{self.path}, row {row + 1} (line {self.lines[row]})"


def read_columns(path: Path, wanted: Sequence[str], *, time: str = "") -> dict[str, NDArray[np.float64]]:
    """Read named columns of a CSV file with a header line.

    Parameters
    ----------
    path
        The file: UTF-8, fields separated by comma, semicolon or tab. Lines that start with # are comments,
        but the last one is the header where numbers follow it.
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
        If the file is missing, too long, no text, no CSV, or has no header.
    """
    try:
        with path.open("rb") as file:
            raw = file.read((_FILE_MAX_MIB << 20) + 1)
        if len(raw) > _FILE_MAX_MIB << 20:
            raise ConfigError(
                f"{path}: more than {_FILE_MAX_MIB} MiB, which no table of points is. Check the path."
            )
        header, rows, lines = _split(io.StringIO(raw.decode("utf-8-sig"), newline=""))
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror or error}. Check the path and its permissions.") from None
    except (ValueError, csv.Error) as error:  # no UTF-8, a NUL in the path, an open quote
        raise ConfigError(
            f"{path}: not a CSV file ({error}). Save it as comma-separated UTF-8 text."
        ) from None
    if not any(header):
        raise ConfigError(f"{path}: empty, or its first line is. Name the columns in the first line.")
    if not _are_names(header):
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
    skipped, comment, first = 0, "", file.readline()
    while first and (not first.strip() or first.startswith("#")):
        comment = first if first.strip() else comment
        skipped, first = skipped + 1, file.readline()
    delimiter = max(_DELIMITERS, key=(first or comment).count)  # the comma where there is none
    header = _fields(first, delimiter)
    if comment and not _are_names(header):  # the last comment is the header, as numpy writes it
        header, lines = _fields(comment.lstrip("# \t"), delimiter), chain([first], file)
    else:
        skipped, lines = skipped + 1, chain(file)
    reader = csv.reader(lines, delimiter=delimiter, strict=True)
    kept = [(row, reader.line_num + skipped) for row in _worth_keeping(reader)]
    return header, [row for row, _ in kept], [line for _, line in kept]


def _fields(line: str, delimiter: str) -> list[str]:
    return [name.strip() for name in next(csv.reader([line], delimiter=delimiter, strict=True), [])]


def _are_names(header: list[str]) -> bool:
    return any(_finite(name) is None for name in header if name)


def _worth_keeping(rows: Iterator[list[str]]) -> Iterator[list[str]]:
    return (row for row in rows if any(field.strip() for field in row) and not row[0].startswith("#"))


def _numbers(text: Text, wanted: Sequence[str]) -> dict[str, NDArray[np.float64]]:
    _check_names(text, wanted)
    picked = [text.header.index(name) for name in wanted]
    values = np.full((len(text.rows), len(wanted)), math.nan)
    faults: list[str] = []
    for number, row in enumerate(text.rows):
        if any(field.strip() for field in row[len(text.header) :]):
            faults.append(
                f"{text.place(number)}: {len(row)} fields, but the header names {len(text.header)} columns "
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
        more = [f"... and {len(faults) - _NAMED_FAULTS_MAX} more"] if len(faults) > _NAMED_FAULTS_MAX else []
        remedy = "Mend or remove those rows; a lost sample may simply be left out."
        raise ConfigError(*faults[:_NAMED_FAULTS_MAX], *more, remedy)
    return {name: values[:, place].copy() for place, name in enumerate(wanted)}


def _check_names(text: Text, wanted: Sequence[str]) -> None:
    missing = [name for name in wanted if name not in text.header]
    if missing:
        raise ConfigError(
            f"{text.path}: no column {', '.join(missing)}; the header has: {', '.join(text.header)}. "
            "Name the columns in the first line, or map them by options."
        )
    twice = [name for name in wanted if text.header.count(name) > 1]
    if twice:
        raise ConfigError(
            f"{text.path}: more than one column is called {', '.join(twice)}. Give each its own name."
        )
    if not text.rows:
        raise ConfigError(f"{text.path}: a header and no rows. Record something first.")


def _shown(field: str) -> str:
    if not field:
        return "nothing"
    return repr(field if len(field) <= _SHOWN_CHARS_MAX else field[:_SHOWN_CHARS_MAX] + "...")


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
            f"{text.place(k + 1)}: {name} goes from {time[k]:.9g} to {time[k + 1]:.9g}; time must rise from "
            "row to row. Write the rows in the order of their times, one position for each."
        )
