"""Units that a recording may come in: their spellings, and what one of them is in SI."""

from __future__ import annotations

import math
import re
from typing import Literal

from dcmp_hil.errors import ConfigError

Quantity = Literal["time", "position", "torque", "voltage", "velocity"]

COUNTS = "counts"
"""The one position unit whose size is the encoder's own."""

_RAD_PER_DEG, _RAD_PER_REV = math.pi / 180.0, 2.0 * math.pi

# The first spelling of each is the one that messages use; all are compared without case and punctuation.
_SPELLINGS: dict[Quantity, dict[float, tuple[str, ...]]] = {
    "time": {
        1.0: ("s", "sec", "secs", "second", "seconds", "sekunden"),
        1e-3: ("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"),
        1e-6: ("us", "µs", "usec", "usecs", "micros", "microsecond", "microseconds"),
        1e-9: ("ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanosecond", "nanoseconds"),
        60.0: ("min", "minute", "minutes"),
        3600.0: ("h", "hour", "hours"),
    },
    "position": {
        1.0: ("rad", "rads", "radian", "radians"),
        1e-3: ("mrad", "milliradian", "milliradians"),
        _RAD_PER_DEG: ("deg", "degs", "degree", "degrees", "°", "grad"),
        _RAD_PER_DEG / 1e3: ("mdeg", "millideg", "millidegree", "millidegrees"),
        _RAD_PER_DEG / 60.0: ("arcmin", "arcminute", "arcminutes"),
        _RAD_PER_DEG / 3600.0: ("arcsec", "arcsecond", "arcseconds"),
        math.pi / 200.0: ("gon",),
        _RAD_PER_REV: ("rev", "revs", "revolution", "revolutions", "turn", "turns", "umdrehungen"),
        math.nan: (COUNTS, "count", "ticks", "tick", "cts", "lsb", "inc", "increments", "inkremente"),
    },
    "torque": {
        1.0: ("N m", "newton metre", "newton metres", "newton meter", "newton meters"),
        1e-3: ("mN m", "N mm"),
        1e-2: ("cN m", "N cm"),
        1e-6: ("uN m", "µN m"),
        1e3: ("kN m",),
    },
    "voltage": {1.0: ("V", "volt", "volts"), 1e-3: ("mV", "millivolt", "millivolts"), 1e3: ("kV",)},
    "velocity": {
        1.0: ("rad/s", "rad/sec", "rad per s", "rad per sec", "radps", "rad s-1", "rad s^-1"),
        1e-3: ("mrad/s", "mrad/sec", "mradps"),
        _RAD_PER_DEG: ("deg/s", "deg/sec", "deg per s", "degps", "dps", "°/s"),
        _RAD_PER_REV: ("rev/s", "rev/sec", "rev per s", "revps", "rps", "turns/s"),
        _RAD_PER_REV / 60.0: ("rpm", "rev/min", "r/min", "1/min", "u/min"),
    },
}
SI: dict[Quantity, str] = {quantity: next(iter(sizes.values()))[0] for quantity, sizes in _SPELLINGS.items()}
"""The SI unit of each quantity, by its usual spelling."""


def bare(text: str) -> str:
    """Strip a spelling of what does not distinguish it: case, spaces, punctuation, typographic signs."""
    plain = text.lower().replace("µ", "u").replace("μ", "u").replace("°", "deg")
    return re.sub(r"[^a-z0-9]", "", plain)


_UNITS: dict[Quantity, dict[str, tuple[str, float]]] = {
    quantity: {bare(name): (names[0], size) for size, names in sizes.items() for name in names}
    for quantity, sizes in _SPELLINGS.items()
}


def find_unit(quantity: Quantity, spelling: str) -> tuple[str, float] | None:
    """Return the unit with this name, and its factor; None if unknown.

    Parameters
    ----------
    quantity
        What is measured.
    spelling
        Such as ``deg``, ``N m``, ``Nm``, ``rad/s`` or ``rad_s``.

    Returns
    -------
    tuple or None
        The usual spelling, and what one of them is in SI (NaN for counts); None for an unknown one.
    """
    return _UNITS[quantity].get(bare(spelling))


def any_unit(spelling: str) -> bool:
    """Whether a spelling is a unit of any quantity."""
    plain = bare(spelling)
    return bool(plain) and any(plain in units for units in _UNITS.values())


def known_unit(quantity: Quantity, spelling: str) -> tuple[str, float]:
    """Return the unit that an option names, as for `find_unit`.

    Raises
    ------
    ConfigError
        If `quantity` has no such unit.
    """
    unit = find_unit(quantity, spelling)
    if unit is None:
        usual = ", ".join(names[0] for names in _SPELLINGS[quantity].values())
        raise ConfigError(
            f'--{quantity}-unit: got "{spelling}", which is no unit of {quantity}. Write one of: {usual}.'
        )
    return unit
