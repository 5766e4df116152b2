"""References at many instants have the bits of `at`."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.control.references import ReferenceSettings, periodic
from dcmp_hil.control.references.periodic import Chirp, Sine
from dcmp_hil.control.references.piecewise import Hold, Step, Trapezoid
from dcmp_hil.control.references.table import Table
from dcmp_hil.values import Reference

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

_CASES = 60


class _Other(ReferenceSettings):
    """A kind that has `at` alone."""

    def at(self, t: float) -> Reference:
        return Reference(t * t, 2.0 * t, 2.0)


def _random(kind: str, draw: random.Random) -> ReferenceSettings:
    def between(low: float, high: float) -> float:
        return draw.choice((low, high, draw.uniform(low, high)))

    if kind == "sine":
        return Sine(
            amplitude_rad=between(0.0, 3.0),
            rate_rad_s=between(0.01, 20.0),
            phase_rad=between(-7.0, 7.0),
            offset_rad=between(-3.0, 3.0),
        )
    if kind == "chirp":
        return Chirp(
            kind="chirp",
            amplitude_rad=between(0.0, 1.0),
            from_hz=between(0.0, 3.0),
            to_hz=between(0.01, 3.0),
            sweep_s=between(0.5, 4.0),
            offset_rad=between(-3.0, 3.0),
        )
    if kind == "trapezoid":
        return Trapezoid(
            kind="trapezoid",
            low_rad=between(-1.0, 3.0),
            high_rad=between(-3.0, 3.0),
            velocity_rad_s=between(0.05, 10.0),
            acceleration_rad_s2=between(0.05, 50.0),
            rest_s=between(0.0, 2.0),
        )
    if kind == "step":
        return Step(kind="step", before_rad=between(-1.0, 1.0), after_rad=between(-1.0, 1.0), at_s=0.1)
    return Hold(kind="hold", position_rad=between(-1.0, 1.0)) if kind == "hold" else _Other()


def _instants(draw: random.Random) -> NDArray[np.float64]:
    """Return instants before and at the start, of a grid, and anywhere."""
    grid = np.arange(200) * draw.choice((1e-3, 0.05, 0.1, 1 / 3))
    return np.concatenate(([-1.0, -0.0, 0.1], grid, [draw.uniform(0.0, 100.0) for _ in range(100)]))


def _check(reference: ReferenceSettings, t: NDArray[np.float64]) -> None:
    at = reference.source().at
    expected = np.array([at(one) for one in t.tolist()])
    found = np.array(reference.at_each(t)).T
    assert (expected.view(np.int64) == found.view(np.int64)).all(), reference


@pytest.mark.parametrize("kind", ["sine", "chirp", "trapezoid", "step", "hold", "of one's own"])
def test_references_at_many_instants_have_the_bits_of_one(kind: str) -> None:
    draw = random.Random(7)
    for _ in range(_CASES):
        _check(_random(kind, draw), _instants(draw))


@pytest.mark.parametrize("kind", ["sine", "chirp"])
def test_sines_of_math_have_the_bits_of_one(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(periodic, "_numpy_is_math", lambda: False)
    test_references_at_many_instants_have_the_bits_of_one(kind)


def test_trapezoid_without_a_distance_rests_at_many_instants() -> None:
    _check(Trapezoid(kind="trapezoid", low_rad=0.5, high_rad=0.5), np.arange(10.0))


def test_table_at_many_instants_has_the_bits_of_one(tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    file.write_text("time_s,position_rad\n0,0\n0.5,1\n0.7,0.2\n2,-1\n", encoding="utf-8")
    draw = random.Random(3)
    knots = np.array([0.5, 0.7, 2.0, np.nextafter(2.0, 3.0), np.nextafter(0.0, -1.0)])
    _check(Table(kind="csv", file=str(file)), np.concatenate((knots, _instants(draw))))


def test_no_instants_give_no_references() -> None:
    assert _Other().at_each(np.empty(0)).position.shape == (0,)
