"""The rows of a recording as text: header, units, and what is left out between the rows."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.cells import is_clock, is_value, label_in, number, unit_in
from dcmp_hil.offline.column_names import known_in
from dcmp_hil.offline.decoding import read_lines
from dcmp_hil.offline.dialect import (
    BLANK,
    COMMENT,
    MAJORITY_SHARE,
    comma_pairs,
    find_layout,
    holds_numbers,
    is_row,
    prepared,
    split,
)
from dcmp_hil.offline.units import any_unit

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from dcmp_hil.offline.decoding import Lines
    from dcmp_hil.offline.dialect import Layout

Line = tuple[int, str]  # its number in the file, from 1, and its text

_SHOWN_CHARS_MAX = 50  # characters of a line in a message
_COMPARED_ROWS = 500  # rows at the end that a broken number is compared with
_RARE_ROWS_SHARE = 0.01  # share of rows
_BEND_RATIO_MAX = 2.0  # times the sharpest bend of those rows


class TextTable(NamedTuple):
    """The rows of a recording as text.

    Parameters
    ----------
    path
        Where it came from.
    header
        Names of the columns; their numbers from 1 where the file names none.
    named
        Whether the file names its columns.
    units
        What a row of units, or the cells themselves, say; empty where they say nothing.
    rows
        Fields of each row, one per name in the header.
    lines
        Line of the file that each row stands in, from 1.
    decimal
        Decimal sign of the file.
    notes
        What was left out, one sentence each.
    """

    path: Path
    header: list[str]
    named: bool
    units: list[str]
    rows: list[list[str]]
    lines: list[int]
    decimal: str
    notes: list[str]

    def column(self, name: str) -> list[str]:
        """Return the cells of a column."""
        place = self.header.index(name)
        return [row[place] for row in self.rows]


def read_table(path: Path) -> TextTable:
    """Read a text file of columns, and leave out what is no row.

    Delimiter, decimal sign, header and a row of units are found; what stands before the header, between the
    rows and behind them is left out and counted.

    Parameters
    ----------
    path
        UTF-8, UTF-16 or Windows-1252; fields separated by comma, semicolon, tab, bar or white space.

    Raises
    ------
    ConfigError
        If the file is missing, no text, or has no rows.
    """
    source = read_lines(path)
    lines, forced = prepared(source.lines)
    layout = find_layout(path, [text for _, text in lines], forced)
    joined = comma_pairs(lines, layout)
    if joined:
        lines, layout = joined
    first = next((k for k, (_, text) in enumerate(lines) if is_row(text, layout, whole=True)), -1)
    if first < 0:
        first = next(k for k, (_, text) in enumerate(lines) if is_row(text, layout))
    header, units, before = _names(lines[:first], layout)
    rows, numbers, left_out, repeated = _rows(lines[first:], layout, header)
    if len(left_out) > len(rows):
        raise ConfigError(
            f"{path}: {len(left_out)} lines between the rows are no rows of {layout.width} fields, more than "
            f"there are rows ({len(rows)}); the first is line {left_out[0][0]}: {_shown(left_out[0])}. Save "
            "it with one row a line and the same number of fields in each (no decimal comma where the comma "
            "separates the fields)."
        )
    notes = [*source.notes, *_said(before, left_out, repeated)]
    if joined:
        notes.append("The comma is delimiter and decimal sign: every two fields are one number.")
    if _torn(rows, source, layout.decimal):
        rows.pop()
        numbers.pop()
        notes.append("The last line is unfinished and left out.")
    header, rows, units = _aligned(header, units, rows, layout)
    return TextTable(
        path, header, header != _numbered(layout.width), units, rows, numbers, layout.decimal, notes
    )


def _said(before: Sequence[Line], left_out: Sequence[Line], repeated: int) -> Iterator[str]:
    """Yield a sentence for each kind of row that is left out."""
    if before:
        yield f"{_lines(len(before))} before the header left out ({_shown(before[0])})."
    if repeated:
        yield f"The header comes {repeated + 1} times; the later ones are left out."
    if left_out:
        where = f"the first is line {left_out[0][0]} ({_shown(left_out[0])})"
        yield f"{_lines(len(left_out))} left out that no row is; {where}."


def _names(above: Sequence[Line], layout: Layout) -> tuple[list[str], list[str], list[Line]]:
    """Return names, units and other lines above the first row."""
    units: list[str] = []
    nearest: tuple[int, list[str]] | None = None
    for place in range(len(above) - 1, -1, -1):
        text = above[place][1]
        for fields in _as_header(text, layout):
            words = [field for field in fields if field]
            if not units and place > 0 and _are_units(words, layout):
                units = fields
                break
            if words and sum(is_value(word, layout.decimal) for word in words) < MAJORITY_SHARE * len(words):
                if nearest is None and known_in(fields):
                    return fields, units, _text(above[:place])
                if nearest is not None and known_in(fields) > 1:  # such as names above those of the sensors
                    return fields, units, _text(above[:place])
                nearest = nearest or (place, fields)
                break
    # No line has a name that is known: the one above the rows is taken, and options name its columns.
    place, fields = nearest or (len(above), [])
    return fields, units, _text(above[:place])


def _text(lines: Sequence[Line]) -> list[Line]:
    return [line for line in lines if not COMMENT.match(line[1])]


def _as_header(text: str, layout: Layout) -> Iterator[list[str]]:
    """Read a line as names, with the delimiter of the rows or another one, as many as there are columns."""
    bare = COMMENT.sub("", text, count=1) if COMMENT.match(text) else text
    fits = {layout.width, layout.width - 1} - {0}
    for delimiter in (layout.delimiter, ",", ";", "\t", BLANK):
        fields = split(bare, delimiter)
        if len(fields) in fits or (len(fields) > layout.width and delimiter == layout.delimiter != BLANK):
            yield fields
    # Names with a unit apart from them: `time [s] position [rad]`
    grouped = re.findall(r"[^\s\[(]+(?:\s*(?:\[[^\]]*\]|\([^)]*\)))?", bare)
    if len(grouped) == layout.width > 1:
        yield grouped


def _are_units(fields: Sequence[str], layout: Layout) -> bool:
    """Whether the words of a line, numbers left aside, are units."""
    words = [field for field in fields if not is_value(field, layout.decimal)]
    bracketed = sum(bool(re.fullmatch(r"\(.*\)|\[.*\]", word)) for word in words)
    known = sum(any_unit(word) or word in ("-", "%", "1") for word in words)
    return bool(words) and (known > MAJORITY_SHARE * len(words) or bracketed == len(words))


def _rows(
    lines: Sequence[Line], layout: Layout, header: Sequence[str]
) -> tuple[list[list[str]], list[int], list[Line], int]:
    rows, numbers, left_out, repeated = [], [], [], 0
    for place, text in lines:
        fields = split(text, layout.delimiter)
        if len(fields) > layout.width and not any(fields[layout.width :]):
            fields = fields[: layout.width]
        if len(fields) == layout.width and holds_numbers(fields, layout) and not COMMENT.match(text):
            rows.append(fields)
            numbers.append(place)
        elif header and any(list(header) == candidate for candidate in _as_header(text, layout)):
            repeated += 1
        elif not COMMENT.match(text):
            left_out.append((place, text))
    return rows, numbers, left_out, repeated


def _torn(rows: list[list[str]], source: Lines, decimal: str) -> bool:
    """Whether the last row, which has no line end, breaks off within its last number.

    It has fewer decimals than nearly every other, or it is shorter than the one before and leaves the motion.
    """
    fewest = 10  # rows that the usual number of decimals and the usual motion are told from
    if source.ended or len(rows) <= fewest or not source.lines[-1].endswith(rows[-1][-1]):
        return False
    cells = [row[-1] for row in rows]
    decimals = [len(re.split("[.,]", cell)[-1]) if re.search("[.,]", cell) else 0 for cell in cells]
    rare = sum(shown <= decimals[-1] for shown in decimals[:-1]) < _RARE_ROWS_SHARE * len(decimals)
    if rare:
        return True
    values = [number(cell, decimal) for cell in cells[-_COMPARED_ROWS:]]
    bends = [abs(a - 2.0 * b + c) for a, b, c in zip(values, values[1:], values[2:], strict=False)]
    known = [bend for bend in bends[:-1] if not math.isnan(bend)]
    return len(cells[-1]) < len(cells[-2]) and bool(known) and bends[-1] > _BEND_RATIO_MAX * max(known)


def _aligned(
    header: list[str], units: list[str], rows: list[list[str]], layout: Layout
) -> tuple[list[str], list[list[str]], list[str]]:
    """Return a name and a unit for every column."""
    width = layout.width
    first, last = rows[0], layout.width - 1
    labels = [label_in(cell) or "" for cell in first]
    if all(labels[column] for column in layout.numeric) and not any(map(is_clock, first)):
        header = labels
    if not header:
        header = _numbered(width)
    if len(header) == width - 1:
        # One name too few: behind the last value stands a delimiter, or before the first one a row's number.
        header = [*header, ""] if not any(row[last] for row in rows) else ["", *header]
        units = [*units, ""] if not header[-1] else ["", *units]
    if len(header) > width:
        rows = [row + [""] * (len(header) - width) for row in rows]
    header = [name.strip().lstrip("#%").strip() or str(place) for place, name in enumerate(header, 1)]
    units = (units + [""] * len(header))[: len(header)]
    cells = [unit_in(cell) or "" for cell in first] + [""] * (len(header) - width)
    units = [re.sub(r"[\[\]()]", "", told) or cell for told, cell in zip(units, cells, strict=True)]
    return header, rows, units


def _numbered(width: int) -> list[str]:
    """Return what the columns of a file without names are called."""
    return [str(column + 1) for column in range(width)]


def _lines(count: int) -> str:
    return "1 line" if count == 1 else f"{count} lines"


def _shown(line: Line) -> str:
    text = "".join(sign if sign.isprintable() else " " for sign in line[1]).strip()
    return '"' + (text if len(text) <= _SHOWN_CHARS_MAX else text[:_SHOWN_CHARS_MAX] + "...") + '"'
