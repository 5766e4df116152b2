"""Phases and authority in C: those of `dcmp_hil.safety.supervisor` on random cycles, to the bit."""

from __future__ import annotations

import math
import random
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest

from dcmp_hil.safety.supervisor import Phase, Supervisor
from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.values import Estimate, Event, PhaseData, Sample
from tests.firmware.law import Law, same_bits

if TYPE_CHECKING:
    from dcmp_hil.safety.limiter import Limiter
    from dcmp_hil.safety.polarity_check import PolarityCheck
    from tests.firmware.bench import Core

SPEED, DEMAND, MOVING, TRACKING, SATURATION = 3, 2, 9, 15, 16  # enum dcmp_cause
PHASES = list(Phase)
PERIOD = 1e-3
NONE = Estimate(0.0, 0.0, 0.0)


def _request(cause: float) -> TripRequest | None:
    if not cause:
        return None
    return TripRequest(str(int(cause)), "", "", Urgency.RAMP if cause >= TRACKING else Urgency.NOW)


class _Limiter:
    """Limits the voltage, and objects as the row says."""

    def __init__(self, voltage: float, slew: float) -> None:
        self.voltage_limit, self._slew = voltage, slew
        self.objection: TripRequest | None = None
        self.limit_reference = None

    def limit_slew(self, voltage: float, last: float) -> float:
        return max(last - self._slew, min(last + self._slew, voltage))

    def limit_voltage(self, t: float, demand: float, last: float) -> float:
        assert t >= 0.0
        return self.limit_slew(max(-self.voltage_limit, min(self.voltage_limit, demand)), last)


class _Probe:
    """Answers as the row says."""

    found = None

    def __init__(self) -> None:
        self.refusal, self.over, self.voltage = 0.0, False, 0.0

    def check(self, sample: Sample) -> TripRequest | None:
        assert sample.t >= 0.0
        return _request(self.refusal)


class _Check:
    def __init__(self) -> None:
        self.cause = 0.0

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:
        assert sample.position == estimate.position
        return _request(self.cause)


def _rows(seed: int, rare: float) -> list[tuple[float, ...]]:
    """Return cycles with lost ticks, demands beyond every limit, and objections now and then."""
    chance = random.Random(seed)
    rows, tick = list[tuple[float, ...]](), 0

    def one_of(share: float, *causes: int) -> float:
        return float(chance.choice(causes)) if chance.random() < share * rare else 0.0

    for _ in range(700):
        demand = 0.0 if chance.random() < 0.02 else chance.gauss(0.0, 8.0)
        if chance.random() < 0.001 * rare:
            demand = chance.choice([math.nan, math.inf, -math.inf])
        over = float(chance.random() < 0.02)
        voltage = chance.choice([1.0, -1.0, 0.0, 30.0, -30.0])
        objection = one_of(0.002, TRACKING, SATURATION)
        rows.append((tick, one_of(0.001, SPEED), demand, one_of(0.01, MOVING), over, voltage, objection))
        tick += 1 if chance.random() < 0.97 else chance.choice([2, 3, 9, 40])
    return rows


def _wanted(rows: list[tuple[float, ...]], setup: tuple[float, ...]) -> list[list[float]]:
    _, settle, engage, voltage, slew, probes = setup
    limiter, probe, check, told = _Limiter(voltage, slew), _Probe(), _Check(), list[Event]()
    supervisor = Supervisor(
        [check],
        cast("Limiter", limiter),
        settle=settle,
        engage=engage,
        notify=told.append,
        probe=cast("PolarityCheck", probe) if probes else None,
    )
    wanted, cause, cause_tick = [], 0.0, 0.0
    for tick, check.cause, demand, probe.refusal, over, probe.voltage, objection in rows:
        told.clear()
        probe.over = bool(over)
        sample = Sample(tick * PERIOD, 0.0, 0.0)
        begins = supervisor.engages(sample)
        limiter.objection = _request(objection)
        sent = supervisor.safe_voltage(sample, NONE, demand)
        found = supervisor._cause  # noqa: SLF001
        if found is not None and not cause:
            cause, cause_tick = float(DEMAND if found.reason == "not_finite" else int(found.reason)), tick
        last = told[-1].data if told else None
        phase = PHASES.index(Phase(last.phase)) if isinstance(last, PhaseData) else -1.0
        ended = supervisor.over
        orderly = float(ended is not None and ended.orderly)
        row = [sent, PHASES.index(supervisor.phase), begins, ended is not None, orderly, cause, cause_tick]
        wanted.append([*row, float(len(told)), phase])
    return wanted


@pytest.mark.parametrize("settle_engage", [(0.0, 0.0), (0.1, 0.15), (0.0, 0.05)])
@pytest.mark.parametrize("limits", [(10.0, math.inf), (5.0, 0.7), (math.inf, math.inf), (math.inf, 0.3)])
@pytest.mark.parametrize("probes", [0.0, 1.0])
def test_phases_have_the_bits_of_python(
    core: Core, settle_engage: tuple[float, float], limits: tuple[float, float], probes: float
) -> None:
    setup = (PERIOD, *settle_engage, *limits, probes)
    seen = set()
    for seed in range(32):
        rows = _rows(seed, 0.0 if seed < 4 else 0.3 + 0.4 * (seed % 5))
        wanted = np.array(_wanted(rows, setup), float)
        # the refusal's own tick is that of its cycle, also where it comes behind what a check finds
        assert same_bits(Law(core)("phases", np.array(setup), np.array(rows, float), width=9), wanted)
        seen |= set(wanted[:, 1].tolist())
    assert seen >= {float(number) for number in range(1 if probes else 2, 7)} - {2.0} or not settle_engage[0]


def test_single_precision_has_the_same_phases(core: Core) -> None:
    setup, rows = np.array((PERIOD, 0.1, 0.15, 10.0, 0.7, 1.0)), np.array(_rows(11, 2.0), float)
    single, double = (Law(core, kind)("phases", setup, rows, width=9) for kind in ("float_", ""))
    assert np.array_equal(single[:, 5], double[:, 5])
    assert set(single[:, 1]) == set(double[:, 1])
    assert np.abs(single[0] - double[0]).max() < 1e-4
