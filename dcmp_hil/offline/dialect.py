"""Dialect of a text file: delimiter, decimal sign, and form of a row."""

from __future__ import annotations

import csv
import re
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.cells import is_value

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_SAMPLE_LINES = 150  # lines that the layout is told from
MAJORITY_SHARE = 0.5
COMMENT = re.compile(r"\s*(?:#+|%+|//+|;+(?=\s*[A-Za-z#]))\s*")
_SEPARATOR = re.compile(r'\s*"?sep=(.)"?\s*', re.IGNORECASE)
_MONITOR_STAMP = re.compile(  # a serial monitor's time stamp
    r"(\[?\d{1,2}:\d{2}:\d{2}[.,]\d+\]?)\s*(?:->|>)\s*"
)
BLANK = " "  # any white space

# Preferred from the left where two explain the file equally well.
_LAYOUTS = [(delimiter, decimal) for decimal in (".", ",") for delimiter in (",", ";", "\t", "|", BLANK)] + [
    ("", "."),
    ("", ","),
]


class Layout(NamedTuple):
    """Form of a row: delimiter and decimal sign.

    Parameters
    ----------
    delimiter
        Between fields: a space for any white space, empty where a row is one field.
    decimal
        Decimal sign, ``.`` or ``,``.
    width
        Fields of a row.
    numeric
        The columns that hold numbers or times.
    """

    delimiter: str
    decimal: str
    width: int
    numeric: tuple[int, ...]


def prepared(lines: Sequence[str]) -> tuple[list[tuple[int, str]], str]:
    """Return the lines that are not blank with their numbers, and the delimiter of a ``sep=`` line."""
    forced, kept = "", []
    for number, text in enumerate(lines, start=1):
        if not text.strip(" \t"):
            continue
        separator = _SEPARATOR.fullmatch(text) if number < 10 else None  # noqa: PLR2004 - near the top
        if separator:
            forced = separator[1]
            continue
        kept.append((number, text))
    stamped = [_MONITOR_STAMP.match(text) for _, text in kept[: _SAMPLE_LINES * 2]]
    if sum(map(bool, stamped)) > MAJORITY_SHARE * len(stamped):
        kept = [(number, _unstamped(text)) for number, text in kept]
    return kept, forced


def _unstamped(text: str) -> str:
    """Return a line without the time stamp of a serial monitor: the device's own clock is better."""
    return _MONITOR_STAMP.sub("", text, count=1)


def split(text: str, delimiter: str) -> list[str]:
    """Split a line into fields; quotes hold a field together, and an open one ends with the line."""
    if not delimiter:
        return [text.strip()]
    if delimiter == BLANK:
        return [field.strip('"') for field in text.split()]
    if '"' not in text:
        return [field.strip() for field in text.split(delimiter)]
    try:
        return [
            field.strip() for field in next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))
        ]
    except csv.Error:
        return [field.strip() for field in text.split(delimiter)]


def find_layout(path: Path, lines: Sequence[str], forced: str) -> Layout:
    """Return the layout under which most lines are valid rows.

    Parameters
    ----------
    path
        For messages.
    lines
        None of them blank.
    forced
        The delimiter, where the file names it; empty otherwise.

    Raises
    ------
    ConfigError
        If no layout finds a row of numbers.
    """
    step = max(1, len(lines) // _SAMPLE_LINES)
    # The end of a file is sampled more densely than its beginning, which may be a long preamble.
    sample = [text for text in lines[len(lines) // 5 :: step] if not COMMENT.match(text)] or list(lines)
    if len(lines) < _SAMPLE_LINES:
        sample = [text for text in lines if not COMMENT.match(text)]
    found = [
        rated
        for delimiter, decimal in _LAYOUTS
        if not forced or delimiter == forced
        for rated in [_rated(sample, delimiter, decimal)]
        if rated
    ]
    if not found:
        if not lines:
            raise ConfigError(f"{path}: empty. Record something first.")
        raise ConfigError(
            f"{path}: no rows of numbers in it. Save it as comma-separated text: a line with the names of "
            "the columns, then a row a sample, such as: time_s,position_rad,torque_Nm"
        )
    return max(found, key=lambda rated: rated[0])[1]


def _rated(sample: Sequence[str], delimiter: str, decimal: str) -> tuple[float, Layout] | None:
    """Return how well a layout explains the lines, from 0 to 1, and what it makes of them."""
    split_lines = [split(text, delimiter) for text in sample]
    values = [[is_value(field, decimal) for field in fields] for fields in split_lines]
    likely = [
        k for k, row in enumerate(values) if sum(row) >= max(1, MAJORITY_SHARE * _filled(split_lines[k]))
    ]
    if not likely:
        return None
    width = Counter(len(split_lines[k]) for k in likely).most_common(1)[0][0]
    if width == 1 and delimiter:
        return None
    rows = [k for k in likely if len(split_lines[k]) == width]
    share = [sum(values[k][column] for k in rows) / len(rows) for column in range(width)]
    filled = [sum(bool(split_lines[k][column]) for k in rows) / len(rows) for column in range(width)]
    numeric = tuple(
        column for column in range(width) if share[column] >= MAJORITY_SHARE * max(filled[column], 0.1)
    )
    if not numeric:
        return None
    used = [column for column in range(width) if filled[column] > 0.0] or [0]
    clean = sum(share[column] / filled[column] for column in used) / len(used)
    rating = clean * (len(rows) / len(sample)) * (1.0 if width > 1 else MAJORITY_SHARE)
    return rating, Layout(delimiter, decimal, width, numeric)


def _filled(fields: Sequence[str]) -> int:
    return sum(map(bool, fields))


def comma_pairs(
    lines: Sequence[tuple[int, str]], layout: Layout
) -> tuple[list[tuple[int, str]], Layout] | None:
    """Join the halves of numbers with a decimal comma in a file whose fields the comma separates as well.

    It is sure where the rows have twice as many fields as the header, all of them whole numbers.
    """
    width = layout.width
    named = any(
        len(fields := split(text, ",")) == width // 2 and not any(is_value(name, ".") for name in fields)
        for _, text in lines[:_SAMPLE_LINES]
    )
    if layout.delimiter != "," or width % 2 or not named:
        return None
    pair = re.compile(r"([+-]?\d+),(\d+)")
    rows = [text for _, text in lines if len(split(text, ",")) == width]
    if not all(re.fullmatch(rf"{pair.pattern}(,{pair.pattern})*", text.replace(" ", "")) for text in rows):
        return None
    halves = [
        (number, ";".join(f"{a},{b}" for a, b in pair.findall(text.replace(" ", ""))))
        if len(split(text, ",")) == width
        else (number, text.replace(",", ";"))
        for number, text in lines
    ]
    return halves, Layout(";", ",", width // 2, tuple(range(width // 2)))


def is_row(text: str, layout: Layout, *, whole: bool = False) -> bool:
    """Whether a line is a row of numbers: a `whole` one lacks none."""
    if COMMENT.match(text):
        return False
    fields = split(text, layout.delimiter)
    return len(fields) == layout.width and holds_numbers(fields, layout, whole=whole)


def holds_numbers(fields: Sequence[str], layout: Layout, *, whole: bool = False) -> bool:
    """Whether at least half of the cells that are filled hold numbers: all of them in a `whole` row."""
    found = sum(is_value(fields[column], layout.decimal) for column in layout.numeric)
    empty = sum(not fields[column] for column in layout.numeric)
    filled = len(layout.numeric) - empty
    return found >= 1 and (found == filled if whole else found >= MAJORITY_SHARE * filled)
