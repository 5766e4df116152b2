"""The polarity check in C: stages, fit and refusals have the bits of the Python classes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from dcmp_hil.safety.motor_gain_fit import MotorGainFit
from dcmp_hil.safety.polarity_check import PolarityCheck
from dcmp_hil.values import Sample
from tests.firmware.law import Array, Law, same_bits

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dcmp_hil.trip_request import TripRequest
    from tests.firmware.bench import Core

WIDTH = 9
STAGE, CAUSE, FOUND = 0, 1, 7
CAUSES = {
    "Not every number": 8,
    "The arm moves by itself": 9,
    "The amplifier put out": 10,
    "The arm does not answer": 11,
    "The arm goes the wrong way": 12,
    "The arm hardly answers": 13,
    "The arm answers": 14,
}


class Rig(NamedTuple):
    """What is believed, and what is true."""

    ku: float = 5.4
    push: float = 1.0
    gravity: float = 14.03
    quantum: float = math.tau / 4096
    period: float = 1e-3
    gain: float = 1.0  # of what is believed
    slew: float = math.inf  # V/s
    friction: float = 1.3  # rad/s2
    drift: float = 0.0  # rad/s2
    lost: float = 0.0  # share of the ticks

    def setup(self) -> Array:
        return np.array([self.ku, self.push, self.gravity, self.quantum])

    def check(self) -> PolarityCheck:
        return PolarityCheck(self.ku, self.push, self.quantum, gravity=self.gravity)


def _drawn(seed: int) -> Rig:
    rng = np.random.default_rng(seed)
    ku = float(10.0 ** rng.uniform(-1.0, 2.0))
    return Rig(
        ku=ku,
        push=min(10.0, 15.0 / ku * float(rng.uniform(0.5, 2.0))),
        gravity=float(rng.choice([0.0, 14.03, 60.0 * rng.random()])),
        quantum=float(rng.choice([0.0, math.tau / 4096, math.tau / 65536, math.tau / 1000])),
        period=float(rng.choice([1e-3, 5e-4, 2e-3])),
        gain=float(rng.choice([1.0, 1.0, 1.0, -1.0, 0.0]) * 10.0 ** rng.uniform(-1.0, 1.0)),
        slew=float(rng.choice([math.inf, 10.0 ** rng.uniform(0.0, 3.0)])),
        friction=float(rng.choice([0.0, 8.0 * rng.random()])),
        drift=float(rng.choice([0.0, 0.0, 5.0 * (rng.random() - 0.5)])),
        lost=float(rng.choice([0.0, 0.0, 0.05, 0.5])),
    )


def _code(stop: TripRequest | None) -> float:
    return (
        0.0
        if stop is None
        else float(next(n for said, n in CAUSES.items() if stop.sentence.startswith(said)))
    )


def _probed(rig: Rig, seed: int = 0) -> tuple[Array, Array, list[tuple[float, float, float]]]:
    """Let the check of Python probe a rig; return the samples, what C must put out, and what the fit saw.

    The figures of the cause stay out: they are in the sentence.
    """
    rng, check = np.random.default_rng(seed), rig.check()
    seen = list[tuple[float, float, float]]()
    fit: MotorGainFit = vars(check)["_fit"]
    add = fit.add

    def noted(t: float, moved: float, voltage: float) -> None:
        seen.append((t, moved, voltage))
        add(t, moved, voltage)

    vars(fit)["add"] = noted
    tick, x, v, applied, rows, wanted = int(rng.integers(0, 9)), 0.3, 0.0, 0.0, [], []
    for _ in range(2000):
        position = rig.quantum * round(x / rig.quantum) if rig.quantum else x
        stop = check.check(Sample(tick * rig.period, position, applied))
        rows.append((float(tick), position, applied))
        found = check.found or (0.0, 0.0)
        down = check.voltage < 0.0
        stage = 3.0 if check.over else 2.0 if down else float(check.voltage > 0.0)
        wanted.append((stage, _code(stop), check.voltage, *found[:2], check.found is not None))
        if check.over or stop:
            break
        steps = 1 if rng.random() >= rig.lost else int(rng.integers(2, 9))
        tick += steps
        for _ in range(steps):
            step = rig.slew * rig.period
            applied = max(applied - step, min(applied + step, check.voltage))
            v += rig.period * (rig.gain * rig.ku * applied - rig.gravity * math.sin(x - 0.3) + rig.drift)
            v = math.copysign(max(0.0, abs(v) - rig.period * rig.friction), v)
            x += rig.period * v
    return np.array(rows), np.array(wanted, float), seen


def _in_c(core: Core, rig: Rig, rows: Array) -> Array:
    return Law(core)("polarity_check", rig.setup(), rig.period, rows, width=WIDTH)


RIGS = {f"drawn {seed}": _drawn(seed) for seed in range(60)} | {
    "as believed": Rig(),
    "does not answer": Rig(gain=0.0),
    "wrong way": Rig(gain=-1.0),
    "weak": Rig(gain=0.25, gravity=0.0, friction=0.0),
    "strong": Rig(gain=8.0),
    "unsure": Rig(gain=0.3, quantum=math.tau / 500, gravity=0.0, friction=0.0),
    "slow": Rig(slew=1.0),
    "moves": Rig(drift=8.0),
}


@pytest.mark.parametrize("name", RIGS)
def test_check_has_the_bits_of_python(core: Core, name: str) -> None:
    rig = RIGS[name]
    rows, wanted, _ = _probed(rig, 3)
    got = _in_c(core, rig, rows)
    assert same_bits(got[:, [STAGE, CAUSE, 4, 5, 6, FOUND]], wanted)
    assert not got[got[:, CAUSE] == 0.0][:, [2, 3, 8]].any()


def test_every_cause_was_among_them() -> None:
    found = {_probed(rig, 3)[1][-1, 1] for rig in RIGS.values()}
    assert found >= {0.0, 9.0, 10.0, 11.0, 12.0, 14.0}


def test_figures_of_a_refusal_are_those_of_its_sentence(core: Core) -> None:
    forms = {
        9: "{0:+.3f} rad in {1:.3f} s",
        10: "put out {0:.2g} V of the 1 V asked for in {1:.2g} s",
        11: "+1 V moved the arm by {0:+.4f} rad, -1 V by {1:+.4f} rad",
    }
    forms |= dict.fromkeys((12, 13, 14), forms[11])
    for name in ("does not answer", "wrong way", "weak", "strong", "slow", "moves"):
        rig = RIGS[name]
        rows, _, _ = _probed(rig, 3)
        check = rig.check()
        stops = [check.check(Sample(tick * rig.period, *rest)) for tick, *rest in rows.tolist()]
        _, cause, first, second, *_, tick = _in_c(core, rig, rows)[-1].tolist()
        assert stops[-1] is not None
        assert forms[int(cause)].format(first, second) in stops[-1].sentence
        assert tick == rows[-1, 0]


@pytest.mark.parametrize("spoilt", [(math.nan, 0.0), (0.0, math.inf), (-math.inf, math.inf), (1e308, 1e308)])
@pytest.mark.parametrize("when", [0, 50, 150, 250])
def test_number_that_is_none_is_refused_and_forgotten(
    core: Core, spoilt: tuple[float, float], when: int
) -> None:
    rig = Rig()
    rows, _, _ = _probed(rig)
    rows = np.insert(rows, when, (rows[when, 0], *spoilt), axis=0)
    check = rig.check()
    codes = [_code(check.check(Sample(tick * rig.period, *rest))) for tick, *rest in rows.tolist()]
    got = _in_c(core, rig, rows)
    assert got[:, CAUSE].tolist() == codes
    assert codes[when] == 8.0
    assert same_bits(got[when, 2:4], np.array(spoilt))
    assert got[when, 8] == rows[when, 0]


def _stages(rig: Rig, rows: Iterable[tuple[float, float, float]]) -> Array:
    check, found = rig.check(), []
    for tick, position, voltage in rows:
        stop = check.check(Sample(tick * rig.period, position, voltage))
        found.append((_code(stop), check.voltage, *(check.found or (0.0, 0.0))[:2]))
    return np.array(found, float)


def test_stages_at_the_ties(core: Core) -> None:
    """Travel, time and voltage that are exactly those at which a stage ends; time that stands still."""
    rig = Rig(gravity=0.0, quantum=0.0)
    watched = [(0.0, 0.0, 0.0), (50.0, 0.02, 0.0), (51.0, -0.02, 0.0), (100.0, 0.0, 0.0)]
    ends: list[list[tuple[float, float, float]]] = [
        [(120.0, 0.01, 1.0), (150.0, 0.03, 1.0), (160.0, 0.03, -1.0)],
        [(200.0, 0.02, 1.0), (299.0, 0.02, -1.0), (300.0, 0.02, -1.0)],
        [(199.0, 0.02, 1.0), (200.0, 0.02, 1.0), (250.0, 0.08, -1.0), (251.0, 0.0, 1.0)],
        [(110.0, 0.001, 0.9), (120.0, 0.02, 0.9), (121.0, 0.02, 0.9), (140.0, -0.08, -1.0)],
        [(110.0, 0.001, 0.89), (120.0, 0.01, 0.9), (121.0, 0.02, 0.9), (142.0, -0.03, -1.0)],
        [(110.0, 0.008, -0.5), (111.0, 0.02, 0.95), (130.0, 0.0, 0.0), (250.0, -0.02, 0.0)],
        [(110.0, 0.001, 0.5), (120.0, 0.012797, 1.0), (121.0, 0.012, 1.0), (230.0, 0.0, -1.0)],
        [(110.0, 0.001, 0.5), (120.0, 0.012803, 1.0), (121.0, 0.012, -1.0), (230.0, 0.0, -1.0)],
        [(100.0, 0.008, 0.5), (100.0, 0.03, 1.0), (100.0, 0.0, 0.0), (250.0, -0.02, 0.0)],
    ]
    moved = [(0.0, 0.0, 0.0), (50.0, 0.02001, 0.0)]
    for each in (moved, *(watched + end for end in ends)):
        rows = np.array(each)
        got = _in_c(core, rig, rows)
        assert same_bits(got[:, [CAUSE, 4, 5, 6]], _stages(rig, rows.tolist()))


def _fits(rig: Rig, seen: Iterable[tuple[float, float, float]]) -> Array:
    fit, found = MotorGainFit(rig.ku, rig.gravity, rig.quantum), []
    for t, moved, voltage in seen:
        fit.add(t, moved, voltage)
        found.append((*fit.gain(), fit.farthest))
    return np.array(found)


def test_fit_has_the_bits_of_python(core: Core) -> None:
    rng = np.random.default_rng(4)
    for seed in range(40):
        rig = _drawn(seed)
        way = np.round(np.cumsum(rng.normal(0.0, 1e-3, 200)), 3 if seed % 2 else 17) + 0.0
        rows = np.column_stack([np.cumsum(rng.uniform(0.0, 2e-3, 200)), way, rng.uniform(-2.0, 2.0, 200)])
        assert same_bits(Law(core)("motor_gain", rig.setup(), rows, width=3), _fits(rig, rows.tolist()))


@pytest.mark.parametrize("large", [1e60, 1e90, 1e160, 1e300])
def test_fit_of_what_is_too_large_has_the_bits_of_python(core: Core, large: float) -> None:
    rig = Rig()
    rows = np.array([(0.0, 0.0, 0.0), (0.1, 0.01, 1.0), (0.2, 0.02, -1.0)])
    for column in range(3):
        for row in (1, 2):
            spoilt = rows.copy()
            spoilt[row:, column] *= large
            got = Law(core)("motor_gain", rig.setup(), spoilt, width=3)
            assert same_bits(got, _fits(rig, spoilt.tolist()))


class _Fit:
    """A fit that was made already."""

    def __init__(self, gain: float, deviation: float, farthest: float) -> None:
        self._found, self.farthest = (gain, deviation), farthest

    def add(self, *_: float) -> None:
        pass

    def gain(self) -> tuple[float, float]:
        return self._found


def test_judgement_has_the_cause_of_python(core: Core) -> None:
    rig = Rig(ku=6.0, push=2.0, quantum=0.5)
    gains = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 6.0, 17.0, 18.0, 19.0, 20.0, math.nan, math.inf)
    rows = [
        (gain, deviation, farthest, reached)
        for gain in gains
        for deviation in (0.0, 0.25, 0.5, math.nan, math.inf)
        for farthest in (0.25, 0.5, 0.75, math.inf)
        for reached in (0.0, 1.0, 1.2, 2.0)
    ]
    wanted = []
    for gain, deviation, farthest, reached in rows:
        check = rig.check()
        vars(check)["_fit"] = _Fit(gain, deviation, farthest)
        stops = [check.check(Sample(0.1 * k, 0.0, reached)) for k in range(4)]
        wanted.append(_code(stops[-1]))
    assert set(wanted) == {0.0, 10.0, 11.0, 12.0, 13.0, 14.0}
    assert Law(core)("polarity_cause", rig.setup(), np.array(rows)).tolist() == wanted


def test_single_precision_measures_the_same_gain(core: Core) -> None:
    rig = Rig(period=2.0**-10)  # no stage ends at a tie
    rows, wanted, _ = _probed(rig)
    got = Law(core, "float_")("polarity_check", rig.setup(), rig.period, rows, width=WIDTH)
    assert got[-1, STAGE] == 3.0
    assert got[-1, 5:7] == pytest.approx(wanted[-1, 3:5], rel=1e-3)
