"""Which column of a recording is which, by its name."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.common.similar_names import did_you_mean
from dcmp_hil.errors import ConfigError
from dcmp_hil.offline.named_units import written_unit
from dcmp_hil.offline.units import SI, bare, find_unit, known_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.offline.units import Quantity

# Words that a quantity goes by, the likeliest first; German ones, too, since Excel and LabVIEW write them.
_QUANTITY_NAMES: dict[Quantity, tuple[str, ...]] = {
    "time": (
        "time",
        "t",
        "timestamp",
        "stamp",
        "elapsed",
        "clock",
        "times",
        "timestamps",
        "zeit",
        *("datetime", "uhrzeit", "zeitstempel"),
    ),
    "position": (
        *("position", "pos", "q", "angle", "theta", "phi", "x", "x1", "y", "joint", "encoder", "winkel"),
        *("drehwinkel", "enc", "counts"),
    ),
    "torque": ("torque", "tau", "trq", "u", "effort", "drehmoment"),
    "voltage": ("voltage", "volt", "volts", "u", "v", "spannung"),
    "velocity": (
        *("velocity", "vel", "speed", "omega", "qd", "dq", "qdot", "thetadot", "x2", "v"),
        *("geschwindigkeit", "drehzahl"),
    ),
}
# Whole names whose words alone would not tell.
_WHOLE_NAMES: dict[str, Quantity] = {
    "x value": "time",
    "x values": "time",
    "date time": "time",
    "datum uhrzeit": "time",
    "datum zeit": "time",
    "counts": "position",
}
_WHOLE_NAMES |= dict.fromkeys(
    ("millis", "micros", "ms", "us", "sec", "secs", "seconds", "milliseconds"), "time"
)
_NO_UNIT = ("", "1", "none", "na", "sequence", "sample", "samples", "index", "number", "date", "time")
_SHOWN_NAMES_MAX = 30
_ROW_NAMES = ("sample", "samples", "sample number", "sample no", "n", "k", "index", "idx", "seq", "sequence")
_AMBIGUOUS_NAMES = {"u", "v"}  # they could be two things: taken only where a unit in the name says which


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


# What a name may add to one of these words: nothing of consequence, that it is the command rather than the
# measurement, or that it is something else altogether.
_PLAIN_WORDS = _words("""measured meas mes actual act real fb feedback applied given rel
    motor joint pendulum arm shaft output encoder angle angular""")
_COMMAND_WORDS = _words("command commanded cmd desired des demand demanded sent control ctrl")
_DRIVE_WORDS = _words("drive input amp amplifier")
_OTHER_WORDS = _words("""reference ref target setpoint goal error err estimate estimated est hat true filtered
    filt limit min max std constant offset index id acceleration accel acc current temperature temp
    bus supply battery dc""")
_ALL_NAMES = frozenset(word for words in _QUANTITY_NAMES.values() for word in words)
_DESCRIBING_WORDS = (
    _PLAIN_WORDS
    | _COMMAND_WORDS
    | _DRIVE_WORDS
    | _OTHER_WORDS
    | _ALL_NAMES
    | frozenset(_NO_UNIT)
    | _words("""unwrapped
    wrapped raw since start boot begin measurement relative absolute cw ccw in of the and from""")
)


_AMBIGUITY_REASONS = {
    "option": "by option",
    "name": "by its name",
    "units": "by the file",
    "values": "by its values",
    "assumed": "assumed",
}


class Match(NamedTuple):
    """A column and the unit that it is in.

    Parameters
    ----------
    quantity
        What it holds.
    column
        Its name in the file.
    unit
        The usual spelling of its unit.
    size
        What one of that unit is in SI; NaN for counts.
    source
        Who says so: ``option``, ``name``, ``units`` (a row of units, the cells), ``values``, ``assumed``.
    """

    quantity: Quantity
    column: str
    unit: str
    size: float
    source: str

    def __str__(self) -> str:
        """Return the match as one line of text."""
        why = _AMBIGUITY_REASONS[self.source]
        return f'{self.quantity}: column "{self.column}" in {self.unit} ({why})'


def match(
    quantity: Quantity,
    header: Sequence[str],
    column: str | None,
    unit: str | None,
    units: Sequence[str] = (),
) -> Match | None:
    """Return the column of a quantity; None if there is none.

    Parameters
    ----------
    quantity
        What is looked for.
    header
        Names of the columns in the file.
    column
        The one that an option names; None looks for the likeliest.
    unit
        The unit that an option names; None takes it from the column's name (``position_deg``), then from
        `units`, SI by default.
    units
        What the file says about each column's unit, or nothing.

    Returns
    -------
    Match or None
        None where no column looks like it.

    Raises
    ------
    ConfigError
        If an option names a column or a unit that does not exist, the name writes a unit that is unknown, or
        two columns look equally likely.
    """
    name = _likeliest(quantity, header) if column is None else _named(quantity, header, column)
    if name is None:
        return None
    if unit is not None:
        return Match(quantity, name, *known_unit(quantity, unit), "option")
    words, found = _parts(quantity, name)
    found = written_unit(quantity, name, _DESCRIBING_WORDS) or found
    if found is None and len(words) == 1:
        found = find_unit(quantity, words[0])
    if found is not None:
        return Match(quantity, name, *found, "name")
    told = units[list(header).index(name)] if units else ""
    if not told or bare(told) in _NO_UNIT or is_format(told):
        return Match(quantity, name, SI[quantity], 1.0, "assumed")
    in_file = find_unit(quantity, told)
    if in_file is None:
        raise ConfigError(
            f'{quantity}: the file says that column "{name}" is in "{told}", which is no unit of {quantity}. '
            f"Say its unit: --{quantity}-unit, or another column: --{quantity}."
        )
    return Match(quantity, name, *in_file, "units")


def is_format(told: str) -> bool:
    """Whether what stands for a unit is how a time is written, such as ``hh:mm:ss.SSS``."""
    return re.search(r"[hHmM]{1,2}:[mMsS]{1,2}|[yY]{2}", told) is not None


def known_in(fields: Sequence[str]) -> int:
    """Return how many quantities the names of a line are known as."""
    return sum(any(_rank(quantity, name) is not None for name in fields) for quantity in _QUANTITY_NAMES)


def sample_number(header: Sequence[str]) -> str | None:
    """Return the column that numbers the samples, if one is called so."""
    return next((name for name in header if " ".join(_parts("time", name)[0]) in _ROW_NAMES), None)


def split_time(header: Sequence[str]) -> tuple[str, str] | None:
    """Return the two columns of a time in whole seconds and their fraction, such as `secs` and `nsecs`."""
    ends: dict[tuple[str, ...], dict[float, str]] = {}
    for name in header:
        words = re.findall(r"[a-z0-9]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower())
        unit = find_unit("time", words[-1]) if words else None
        if unit:
            ends.setdefault(tuple(words[:-1]), {})[unit[1]] = name
    for sizes in ends.values():
        smaller = [name for size, name in sizes.items() if size < 1.0]
        if 1.0 in sizes and len(smaller) == 1:
            return sizes[1.0], smaller[0]
    return None


def _named(quantity: Quantity, header: Sequence[str], column: str) -> str:
    if column.strip() in header:
        return column.strip()
    same = [name for name in header if name.lower() == column.strip().lower()]
    if len(same) == 1:
        return same[0]
    if column.strip().isdigit() and 0 < int(column) <= len(header):  # by its place, from 1
        return header[int(column) - 1]
    hint = did_you_mean(column, header, "Name one of these.")
    raise ConfigError(f'--{quantity}: no column "{column}"; the header has: {listed(header)}. {hint}')


def listed(names: Sequence[str], between: str = ", ") -> str:
    """Return names for a message, the first thirty of many."""
    more = len(names) - _SHOWN_NAMES_MAX
    shown = between.join(names[:_SHOWN_NAMES_MAX])
    return f"{shown} and {more} more" if more > 0 else shown


def _likeliest(quantity: Quantity, header: Sequence[str]) -> str | None:
    ranked = sorted((rank, name) for name in header if (rank := _rank(quantity, name)) is not None)
    best = [name for rank, name in ranked if rank == ranked[0][0]]
    if len(best) > 1:
        raise ConfigError(
            f"{quantity}: {listed(best, ' and ')} look equally likely. "
            f'Say which one it is: --{quantity} "{best[0]}".'
        )
    return best[0] if best else None


def _rank(quantity: Quantity, name: str) -> tuple[int, int] | None:
    """Return the rank of a column, the likeliest smallest; None for another quantity."""
    words, unit = _parts(quantity, name)
    if " ".join(words) in _WHOLE_NAMES:
        return (1, 99) if _WHOLE_NAMES[" ".join(words)] == quantity else None
    words = [_without_number(quantity, word) for word in words]
    names = [
        word for word in words if word in _QUANTITY_NAMES[quantity] and (unit or word not in _AMBIGUOUS_NAMES)
    ]
    if (
        not names
        and unit
        and words
        and quantity != "time"
        and _PLAIN_WORDS.union(_DRIVE_WORDS).issuperset(words)
    ):
        return (4, 0)  # such as motor_V
    rest = [word for word in words if word not in names[:1]]
    if not names or _OTHER_WORDS.intersection(words) or any(_says_other(quantity, word) for word in rest):
        return None
    order = _QUANTITY_NAMES[quantity].index(names[0])
    if _COMMAND_WORDS.intersection(words):
        # The next best thing for an input, and nothing of a measurement.
        return (3, order) if quantity in ("torque", "voltage") else None
    if not rest:
        return (0, order)
    return (1 if _PLAIN_WORDS.issuperset(rest) else 2, order)


def _without_number(quantity: Quantity, word: str) -> str:
    """Return a word without the number of a joint, as in `position0`."""
    bare = word.rstrip("0123456789")
    return bare if len(bare) > 2 and bare in _QUANTITY_NAMES[quantity] else word  # noqa: PLR2004 - x1 is a name


def _says_other(quantity: Quantity, word: str) -> bool:
    """Whether a word names another quantity outright, like the second one of `joint_velocity`."""
    if word in _PLAIN_WORDS or word in _QUANTITY_NAMES[quantity] or len(word) == 1:
        return False
    return any(word in names for other, names in _QUANTITY_NAMES.items() if other != quantity)


def _parts(quantity: Quantity, name: str) -> tuple[list[str], tuple[str, float] | None]:
    """Split a name into its words and the unit at its end, if there is one."""
    spaced = re.sub(r"([a-z])([A-Z][a-z])", r"\1 \2", name)
    words = re.findall(r"[a-z0-9µμ°]+", spaced.lower())
    for length in range(min(3, len(words) - 1), 0, -1):
        unit = find_unit(quantity, " ".join(words[-length:]))
        if unit:
            return words[:-length], unit
    return words, None
