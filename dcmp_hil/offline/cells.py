"""Content of a cell of a recording: a number, a time of day, or neither."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.offline.units import any_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

DAY_S = 86_400.0  # s

_CELL_CHARS_MAX = 400  # characters: a longer cell is text, and searching it would take long
_SPACES = "\u00a0\u202f\u2009"
_PLAIN_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?")
_HEX_NUMBER = re.compile(r"0[xX][0-9a-fA-F]{1,8}")
_DECORATED_NUMBER = re.compile(
    r"[(\['=]*\s*(?:[A-Za-z_]\w*\s*[:=]\s*)?(?P<number>[+\-\u2212]?[\d.,].*?)\s*[)\]']*"
)
_NUMBER_WITH_UNIT = re.compile(r"(?P<number>.*?[\d.,])\s*(?P<unit>[^\d\s.,+-][^\d,;]*)")
_GROUPED_NUMBER = {
    ".": re.compile(rf"[+-]?[1-9]\d{{0,2}}([,' {_SPACES}]\d{{3}})+(\.\d*)?"),
    ",": re.compile(rf"[+-]?[1-9]\d{{0,2}}([.' {_SPACES}]\d{{3}})+(,\d*)?"),
}
_CLOCK_TIME = re.compile(
    r"""[("']*\s*
    (?:(?P<date>\d{4}-\d{1,2}-\d{1,2} | \d{4}/\d{1,2}/\d{1,2} | \d{8}
        | \d{1,2}[./-](?:\d{1,2}|[A-Za-z]{3,4})[./-]\d{2,4} | [A-Za-z]{3}\s+\d{1,2})[T\s,_]+)?
    (?:(?P<hour>\d{1,2}):)?(?P<minute>\d{1,2}):(?P<second>\d{1,2}(?:[.,:]\d+)?)
    \s*(?P<half>[AaPp]\.?[Mm]\.?)?
    \s*(?P<zone>Z|UTC|[+-]\d{2}:?\d{2})?
    \s*[)"']*""",
    re.VERBOSE,
)
_ISO_DATE = re.compile(r"(\d{4})[-/](\d{1,2})[-/](\d{1,2})|(\d{4})(\d{2})(\d{2})")


def number(cell: str, decimal: str = ".") -> float:
    """Return the finite number in a cell; NaN where there is none.

    Thousands separators, a name in front (``pos:0.1``), brackets and a unit behind (``0.1 s``) are taken off.

    Parameters
    ----------
    cell
        Text of the cell.
    decimal
        ``.`` or ``,``.
    """
    if len(cell) > _CELL_CHARS_MAX:
        return math.nan
    text = cell.strip()
    if decimal == "." and _PLAIN_NUMBER.fullmatch(text):
        return _finite(text)
    if _HEX_NUMBER.fullmatch(text):
        return float(int(text, 16))
    dressed = _DECORATED_NUMBER.fullmatch(text)
    if dressed is None:
        return math.nan
    bare = dressed["number"].replace("\u2212", "-")
    value = _undressed(bare, decimal)
    if math.isnan(value):
        tail = _NUMBER_WITH_UNIT.fullmatch(bare)
        if tail and any_unit(tail["unit"]):
            value = _undressed(tail["number"], decimal)
    return value


def _undressed(text: str, decimal: str) -> float:
    if _GROUPED_NUMBER[decimal].fullmatch(text):
        keep = f"[^0-9eE+{re.escape(decimal)}-]"
        text = re.sub(keep, "", text)
    if decimal == "," and text.count(",") == 1 and "." not in text:
        text = text.replace(",", ".")
    return _finite(text) if _PLAIN_NUMBER.fullmatch(text) else math.nan


def _finite(text: str) -> float:
    value = float(text.replace("d", "e").replace("D", "e"))
    return value if math.isfinite(value) else math.nan


def unit_in(cell: str) -> str | None:
    """Return the unit that stands behind the number of a cell, if one does."""
    dressed = _DECORATED_NUMBER.fullmatch(cell.strip()) if len(cell) <= _CELL_CHARS_MAX else None
    tail = dressed and _NUMBER_WITH_UNIT.fullmatch(dressed["number"])
    return tail["unit"].strip() if tail and any_unit(tail["unit"]) else None


def label_in(cell: str) -> str | None:
    """Return the name in front of the number of a cell, as in ``pos:0.1``."""
    found = re.match(r"\s*([A-Za-z_]\w*)\s*[:=]\s*[+-]?[\d.]", cell)
    return found[1] if found else None


def is_clock(cell: str) -> bool:
    """Whether a cell holds a time of day, with or without a date."""
    return ":" in cell and len(cell) <= _CELL_CHARS_MAX and _CLOCK_TIME.fullmatch(cell.strip()) is not None


def is_value(cell: str, decimal: str) -> bool:
    """Whether a cell holds a number or a time of day."""
    return not math.isnan(number(cell, decimal)) or is_clock(cell)


def numbers(cells: Sequence[str], decimal: str) -> NDArray[np.float64]:
    """Turn a column into numbers, shape (n,); NaN where a cell holds none.

    A column that reads better with the other decimal sign is read with it.
    """
    if decimal == ".":
        try:
            values = np.array(cells, dtype=np.float64)
        except ValueError:
            pass
        else:
            values[~np.isfinite(values)] = np.nan
            return values
    other = "," if decimal == "." else "."
    read, again = (np.array([number(cell, sign) for cell in cells]) for sign in (decimal, other))
    return again if np.isfinite(again).sum() > np.isfinite(read).sum() else read


def clock_times(cells: Sequence[str]) -> NDArray[np.float64]:
    """Turn times of day, or ISO dates with times, into seconds.

    Parameters
    ----------
    cells
        Such as ``2026-03-02T10:11:12.002+01:00``, ``02.03.2026 10:11:12,002``, ``10:11:12.002``. A date
        counts where it is written year first; otherwise midnight is a step back by a day.

    Returns
    -------
    numpy.ndarray
        s, shape (n,): since midnight of the first date, or since midnight; NaN where a cell holds no time.
    """
    times = np.array([_seconds(cell) for cell in cells]).reshape(-1, 2)
    known = np.isfinite(times[:, 0])
    if known.any():
        times[:, 0] -= times[known, 0][0]
    seconds: NDArray[np.float64] = times[:, 0] * DAY_S + times[:, 1]
    return seconds


def _seconds(cell: str) -> tuple[float, float]:
    """Return the days since 1970 (0 where no ISO date is), and the seconds of the day in UTC."""
    found = _CLOCK_TIME.fullmatch(cell.strip())
    if found is None:
        return math.nan, math.nan
    hour = int(found["hour"] or 0)
    if found["half"]:
        hour = hour % 12 + (12 if found["half"].lower().startswith("p") else 0)
    second = float(re.sub("[,:]", ".", found["second"]))
    zone = found["zone"]
    away = 0
    if zone and zone[0] in "+-":
        away = int(zone[0] + "60") * int(zone[1:3]) + int(zone[0] + zone[-2:])
    days = _days(found["date"]) if found["date"] else 0.0
    return days, 3600.0 * hour + 60.0 * (int(found["minute"]) - away) + second


@cache
def _days(date: str) -> float:
    found = _ISO_DATE.fullmatch(date)
    if found is None:
        return 0.0
    year, month, day = (part for part in found.groups() if part)
    try:
        return float(np.datetime64(f"{year}-{int(month):02d}-{int(day):02d}", "D").astype(int))
    except ValueError:
        return math.nan
