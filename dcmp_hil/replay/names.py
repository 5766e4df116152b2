"""Which column of a recording is which, by its name."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import ConfigError
from dcmp_hil.replay.units import SI, find_unit, known_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.replay.units import Quantity

# Words that a quantity goes by, the likeliest first.
_NAMES: dict[Quantity, tuple[str, ...]] = {
    "time": ("time", "t", "timestamp", "stamp", "elapsed", "clock", "times", "timestamps"),
    "position": ("position", "pos", "q", "angle", "theta", "phi", "x", "x1", "y", "joint", "encoder"),
    "torque": ("torque", "tau", "trq", "u"),
    "voltage": ("voltage", "volt", "volts", "u", "v"),
    "velocity": ("velocity", "vel", "speed", "omega", "qd", "dq", "qdot", "thetadot", "x2", "v"),
}
_UNSURE = {"u", "v"}  # they could be two things: taken only where a unit in the name says which


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


# What a name may add to one of these words: nothing of consequence, that it is the command rather than the
# measurement, or that it is something else altogether.
_PLAIN = _words("""measured meas mes actual act real fb feedback applied given rel
    motor joint pendulum arm shaft output encoder angle angular""")
_COMMAND = _words("command commanded cmd desired des demand demanded sent control ctrl")
_OTHER = _words("""reference ref target setpoint goal error err estimate estimated est hat true filtered filt
    limit min max std constant offset index id acceleration accel acc current temperature temp
    bus supply battery dc""")


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
        Who says so: ``option``, ``name`` or ``assumed``.
    """

    quantity: Quantity
    column: str
    unit: str
    size: float
    source: str

    def __str__(self) -> str:
        """Say it in a line."""
        why = {"option": "by option", "name": "by its name", "assumed": "assumed"}[self.source]
        return f'{self.quantity}: column "{self.column}" in {self.unit} ({why})'


def match(quantity: Quantity, header: Sequence[str], column: str | None, unit: str | None) -> Match | None:
    """Find the column of a quantity.

    Parameters
    ----------
    quantity
        What is looked for.
    header
        Names of the columns in the file.
    column
        The one that an option names; None looks for the likeliest.
    unit
        The unit that an option names; None takes it from the column's name (``position_deg``), SI by default.

    Returns
    -------
    Match or None
        None where no column looks like it.

    Raises
    ------
    ConfigError
        If an option names a column or a unit that does not exist, or two columns look equally likely.
    """
    name = _likeliest(quantity, header) if column is None else _named(quantity, header, column)
    if name is None:
        return None
    if unit is not None:
        return Match(quantity, name, *known_unit(quantity, unit), "option")
    _, found = _parts(quantity, name)
    return (
        Match(quantity, name, *found, "name")
        if found
        else Match(quantity, name, SI[quantity], 1.0, "assumed")
    )


def _named(quantity: Quantity, header: Sequence[str], column: str) -> str:
    if column.strip() in header:
        return column.strip()
    same = [name for name in header if name.lower() == column.strip().lower()]
    if len(same) == 1:
        return same[0]
    close = get_close_matches(column, header, n=1)
    hint = f'Did you mean "{close[0]}"?' if close else "Name one of these."
    raise ConfigError(f'--{quantity}: no column "{column}"; the header has: {", ".join(header)}. {hint}')


def _likeliest(quantity: Quantity, header: Sequence[str]) -> str | None:
    ranked = sorted((rank, name) for name in header if (rank := _rank(quantity, name)) is not None)
    best = [name for rank, name in ranked if rank == ranked[0][0]]
    if len(best) > 1:
        raise ConfigError(
            f"{quantity}: {' and '.join(best)} look equally likely. "
            f'Say which one it is: --{quantity} "{best[0]}".'
        )
    return best[0] if best else None


def _rank(quantity: Quantity, name: str) -> tuple[int, int] | None:
    """How likely it is, the smallest first; None for a column of something else."""
    words, unit = _parts(quantity, name)
    names = [word for word in words if word in _NAMES[quantity] and (unit or word not in _UNSURE)]
    rest = [word for word in words if word not in names[:1]]
    if not names or _OTHER.intersection(words) or any(_says_other(quantity, word) for word in rest):
        return None
    order = _NAMES[quantity].index(names[0])
    if _COMMAND.intersection(words):
        # The next best thing for an input, and nothing of a measurement.
        return (3, order) if quantity in ("torque", "voltage") else None
    if not rest:
        return (0, order)
    return (1 if _PLAIN.issuperset(rest) else 2, order)


def _says_other(quantity: Quantity, word: str) -> bool:
    """Whether a word names another quantity outright, like the second one of `joint_velocity`."""
    if word in _PLAIN or word in _NAMES[quantity] or len(word) == 1:
        return False
    return any(word in names for other, names in _NAMES.items() if other != quantity)


def _parts(quantity: Quantity, name: str) -> tuple[list[str], tuple[str, float] | None]:
    """Split a name into its words and the unit at its end, if there is one."""
    spaced = re.sub(r"([a-z])([A-Z][a-z])", r"\1 \2", name)
    words = re.findall(r"[a-z0-9µμ°]+", spaced.lower())
    for length in range(min(3, len(words) - 1), 0, -1):
        unit = find_unit(quantity, " ".join(words[-length:]))
        if unit:
            return words[:-length], unit
    return words, None
