"""The unit that a column's name writes in brackets or behind a slash."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.units import find_unit

if TYPE_CHECKING:
    from collections.abc import Container

    from dcmp_hil.offline.units import Quantity

_BRACKETED = re.compile(r"[^\[({]*[\w\s.][\[({]\s*([^\[\](){}]*?)\s*[\])}]\s*")
_SLASHED = re.compile(r"\s*[^\W\d_]\w*\s*/\s*([^\s/]{1,7})\s*")
_PER_CENT = re.compile(r".*[\w\s](%)\s*")
_CHANNEL_NAME = re.compile(r"#?\d+|[A-Za-z]+[\s_]?\d+")
_CLOCK_WORD = re.compile(r"utc|gmt|local|relative|absolute|date|iso\W*\d*", re.IGNORECASE)
_DAMAGED_DEGREE = "\u00ef\u00bf\u00bd"  # U+FFFD in UTF-8, read as Windows-1252


def written_unit(quantity: Quantity, name: str, plain: Container[str]) -> tuple[str, float] | None:
    """Return the unit in the brackets of a name, such as ``Winkel [deg]``, or behind its slash: ``phi/deg``.

    A degree sign that another encoding has made another sign is one still: no other unit of a position is
    a single sign beyond ASCII.

    Parameters
    ----------
    quantity
        What the column holds.
    name
        Of the column.
    plain
        Words that describe a column and are no unit.

    Returns
    -------
    tuple or None
        As from `find_unit`; None where the name writes no unit in this way.

    Raises
    ------
    ConfigError
        If what stands there is no unit of `quantity`: SI instead of it would be a wrong figure.
    """
    told = next(
        (found[1] for form in (_BRACKETED, _SLASHED, _PER_CENT) if (found := form.fullmatch(name))), ""
    )
    unit = find_unit(quantity, told) or _degrees(quantity, told)
    if not told or unit:
        return unit
    words = re.findall(r"[^\s,;:_]+", told)
    units = [known for word in words if (known := find_unit(quantity, word))]
    described = all(word.lower() in plain for word in words if not find_unit(quantity, word))
    if len(units) == 1 and described:
        return units[0]
    if not units and (described or _CHANNEL_NAME.fullmatch(told) or _is_time(quantity, told)):
        return None
    raise ConfigError(
        f'{quantity}: the column "{name}" is in "{told}", which is no unit of {quantity}. '
        f"Say its unit: --{quantity}-unit, or another column: --{quantity}."
    )


def _degrees(quantity: Quantity, told: str) -> tuple[str, float] | None:
    if quantity not in ("position", "velocity"):
        return None
    sign, slash, rest = told.partition("/")
    if sign != _DAMAGED_DEGREE and (len(sign) != 1 or sign.isascii()):
        return None
    return find_unit(quantity, f"deg{slash}{rest}")


def _is_time(quantity: Quantity, told: str) -> bool:
    """Whether it is a time zone, or how a time is written."""
    if quantity != "time":
        return False
    zone = re.fullmatch(r"(UTC|GMT)?\s*[+-]\d{1,2}(:?\d{2})?", told)
    return bool(zone or _CLOCK_WORD.fullmatch(told) or re.search(r"[hHmM]{1,2}:[mMsS]{1,2}|[yY]{2}", told))
