"""From the number of a run to its values: its place in the grid, and its draws."""

from __future__ import annotations

import json
import math
import zlib
from typing import TYPE_CHECKING

from dcmp_hil.config.toml_text import parse_value
from dcmp_hil.control.counted_random import FIRST_FREE_STREAM, CountedRandom
from dcmp_hil.control.elementary import exponential, logarithm

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.sweeping.spec import DrawRule, Scalar, SweepSpec

NOISE_SEED = "sim.seed"
"""The key that every run has a value of its own of, unless the spec says otherwise."""
_STREAMS = 1 << 32
_SEED_HIGH_BITS = 20  # of the second word: a seed is exact in a double, and in JSON


class SweepDesign:
    """The values of every run of a spec.

    Run `n` is draw `n % runs` at point `n // runs` of the grid, whose last key changes fastest. A draw
    depends on (seed, key, draw) alone: every point of the grid sees the same draws, so that points differ by
    the grid and not by chance, and neither another key nor more runs change a draw.

    Parameters
    ----------
    spec
        Of the sweep.
    """

    def __init__(self, spec: SweepSpec) -> None:
        self._axes, self._runs = spec.axes, spec.runs
        self._draws = [_draw(spec.seed, key, rule) for key, rule in spec.draw.items()]
        self._seeds = None if NOISE_SEED in {*spec.keys, *spec.set} else _seeds(spec.seed)
        self.total = spec.total
        self.keys = spec.keys if self._seeds is None else (*spec.keys, NOISE_SEED)

    def values(self, run: int) -> tuple[Scalar, ...]:
        """Return the value of each of `keys` in a run."""
        point, draw = divmod(run, self._runs)
        places: list[Scalar] = []
        for axis in reversed(self._axes):
            point, place = divmod(point, len(axis))
            places.append(axis[place])
        found = [*reversed(places), *(one(draw) for one in self._draws)]
        return tuple(found) if self._seeds is None else (*found, self._seeds(draw))

    def overrides(self, run: int) -> list[str]:
        """Return the keys and values of a run as behind `--set`."""
        return [override(key, value) for key, value in self.named(run).items()]

    def named(self, run: int) -> dict[str, Scalar]:
        """Return the keys of a run with their values."""
        return dict(zip(self.keys, self.values(run), strict=True))


def override(key: str, value: Scalar) -> str:
    """Return `key=value` that reads back as the same value."""
    if isinstance(value, str):
        return f"{key}={value if parse_value(value) == value else json.dumps(value)}"
    return f"{key}={json.dumps(value)}"


def _seeds(seed: int) -> Callable[[int], int]:
    words = CountedRandom(seed, FIRST_FREE_STREAM).words

    def of_draw(draw: int) -> int:
        low, high, _, _ = words(draw)
        return low | (high >> 32 - _SEED_HIGH_BITS) << 32

    return of_draw


def _draw(seed: int, key: str, rule: DrawRule) -> Callable[[int], Scalar]:
    """Return the function from the number of a draw to its value."""
    first = FIRST_FREE_STREAM + 1
    random = CountedRandom(seed, first + zlib.crc32(key.encode()) % (_STREAMS - first))
    if rule.choice is not None:
        choice = rule.choice
        return lambda draw: choice[math.floor(random.uniform(draw) * len(choice))]
    if rule.normal is not None:
        mean, deviation = rule.normal
        return lambda draw: mean + deviation * random.normal(draw)
    if rule.loguniform is not None:
        low, high = rule.loguniform
        span = logarithm(high / low)
        return lambda draw: min(high, low * exponential(span * random.uniform(draw)))
    low, high = rule.uniform or (0.0, 1.0)
    return lambda draw: low + (high - low) * random.uniform(draw)
