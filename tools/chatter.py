"""Margin of healthy runs to the limit for chatter: `make chatter`, 1,000 runs and the hard cases.

The figure of a run is the largest mean of |dV/dt| over half a second, over what the rig allows; the check
objects to ten blocks of 50 ms in a row, so a run whose figure stays below 1 is never ended.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dcmp_hil import load_rig, run
from dcmp_hil.config.variation import expected_variation
from dcmp_hil.errors import ConfigError, DcmpError, TripError
from dcmp_hil.safety.chatter import BLOCK_DURATION_S, limit_V_s
from sim_backend.backend import SimBackend

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.result import Result
    from dcmp_hil.values import Sample, Truth
    from sim_backend.encoder import Encoder
    from sim_backend.plant import Plant

_WINDOW_BLOCKS = 10  # blocks
_REFERENCES = (
    (),
    ("reference.rate_rad_s=2.0",),
    ("reference.amplitude_rad=0.05", "reference.rate_rad_s=2.0"),
    ("reference.kind=hold", "reference.position_rad=0.5"),
    ("reference.kind=step", "reference.at_s=2", "reference.after_rad=0.4"),
    ("reference.kind=chirp", "reference.amplitude_rad=0.2"),
)


class Figure(NamedTuple):
    """Result of one run."""

    name: str
    ratio: float  # largest mean of |dV/dt| over half a second, over what is allowed
    ended_by: str  # a reason; empty for a run that went to its end


def figure_of(name: str, rig: Rig, seconds: float) -> Figure:
    """Run a rig in virtual time."""
    ended_by, result = "", None
    try:
        result = run(rig, duration=seconds, fast=True)
    except TripError as trip:
        ended_by, result = trip.reason, trip.result
    except DcmpError as error:
        ended_by, result = type(error).__name__, error.result
    return Figure(name, variation_of(result, rig.period) / limit_V_s(expected_variation(rig)), ended_by)


def variation_of(result: Result | None, period: float) -> float:
    """Return the largest mean of |dV/dt| over half a second, V/s."""
    if result is None or "voltage_sent_V" not in result.columns:
        return math.nan
    voltage, time = result.columns["voltage_sent_V"], result.columns["time_s"]
    periods = max(1, round(BLOCK_DURATION_S / period)) * _WINDOW_BLOCKS
    if len(voltage) <= periods:
        return 0.0
    way = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(voltage)))))
    return float(((way[periods:] - way[:-periods]) / (time[periods:] - time[:-periods])).max())


# ------------------------------------------------------------------------------------------ healthy seeds


def healthy(seed: int) -> list[str]:
    """Draw a healthy rig: an arm anywhere, a plant up to 20 % off the model, an encoder with some noise."""
    draw = random.Random(seed)  # noqa: S311 - a seed names a rig
    angle = draw.uniform(-math.pi, math.pi)
    start = draw.choice((["supervisor.start=immediate"], ["supervisor.probe=off"]))
    off = {key: draw.uniform(0.8, 1.2) for key in ("f1_rad_s2", "gravity_rad_s2", "ku_rad_s2_V")}
    believed = {"f1_rad_s2": 1.3, "gravity_rad_s2": 14.03, "ku_rad_s2_V": 5.4}
    return [
        *start,
        *draw.choice(_REFERENCES),
        *(f"sim.plant.{key}={believed[key] * factor}" for key, factor in off.items()),
        f"sim.position_rad={angle}",
        f"sim.seed={seed}",
        f"sim.encoder_noise_counts={draw.choice((0.0, 0.0, 0.3, 1.0))}",
        f"sim.encoder_phase_counts={draw.random()}",
        f"encoder.counts_per_rev={draw.choice((1024, 2048, 4096, 4096, 4096, 10000))}",
        f"loop.rate_hz={draw.choice((500, 1000, 1000, 1000, 2000))}",
    ]


# --------------------------------------------------------------------------------------------- hard cases


class Case(SimBackend):
    """The simulated rig, with what a hard case does to it."""

    push: Callable[[float, Truth], float] = staticmethod(lambda _, __: 0.0)
    """rad/s2, of time and true state."""
    delay = 0
    """Periods by which the voltage acts later than the host knows."""
    lost = 0.0
    """Probability of each sample to be lost."""
    misplaced = 0.0
    """Counts, by which each edge of the encoder is off, at most."""

    def __init__(self, rig: Rig, clock: Clock) -> None:
        self._ku = rig.plant.ku
        super().__init__(rig, clock, self)
        self._draw = random.Random(rig.sim.seed)  # noqa: S311 - a simulation must repeat itself
        self._edges = [self._draw.uniform(-self.misplaced, self.misplaced) for _ in range(4096)]

    def plant(self, plant: Plant) -> Plant:
        """Return the plant as the case has it."""
        return _Between(plant, self, self._ku, self._period)

    def encoder(self, encoder: Encoder) -> Encoder:
        """Return the encoder as it is."""
        return encoder

    def read(self) -> Sample:
        """Return the next sample that is not lost, its count found at edges that are off."""
        sample = super().read()
        while self.lost and self._draw.random() < self.lost:
            sample = super().read()
        if not self.misplaced:
            return sample
        place = self.truth().position / _COUNT_RAD
        count = math.floor(place)
        up = place - count > 0.5 + self._edges[count % len(self._edges)]
        return sample._replace(position=_COUNT_RAD * (count + up))


_COUNT_RAD = math.tau / 4096


class _Between:
    """A plant whose motor is pushed as well, and hears late of its voltage."""

    def __init__(self, plant: Plant, case: Case, ku: float, period: float) -> None:
        self._plant, self._case, self._ku, self._period = plant, case, ku, period
        self._t = 0.0
        self._waiting = [0.0] * case.delay

    def advance(self, voltage: float) -> Truth:
        """Hold `voltage` (V) for one period and return the state at its end."""
        self._t += self._period
        self._waiting.append(voltage)
        pushed = type(self._case).push(self._t, self._case.truth()) / self._ku
        return self._plant.advance(self._waiting.pop(0) + pushed)

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        self._plant.stretch(factor)


def _steps(t: float, _: Truth) -> float:
    return sum(push for begin, push in ((8.0, 4.0), (14.0, -10.0), (20.0, 6.0)) if t > begin)


def _hands(t: float, _: Truth) -> float:
    turn, place = divmod(t - 5.0, 3.0)
    pushing = t > 5.0 and place < 0.3  # noqa: PLR2004 - a case is its numbers
    return (15.0 if turn % 2 else -15.0) * math.sin(math.pi * place / 0.3) if pushing else 0.0


def _square(t: float, _: Truth) -> float:
    return math.copysign(3.0, math.sin(math.tau * 0.4 * t)) + math.sin(math.tau * 3.0 * t)


def _knocks(t: float, _: Truth) -> float:
    return 60.0 if t > 5.0 and (t - 5.0) % 4.0 < 0.01 else 0.0  # noqa: PLR2004 - a case is its numbers


def _stribeck(extra: float, now: Truth) -> float:
    return -1.3 * extra * math.exp(-((now.velocity / 0.05) ** 2)) * math.copysign(1.0, now.velocity)


_CASES: Mapping[str, Mapping[str, Any]] = {
    "delay +2 ms that the host does not know": {"delay": 2},
    "delay +4 ms that the host does not know": {"delay": 4},
    "lost 5 %": {"lost": 0.05},
    "lost 20 %": {"lost": 0.2},
    "edges misplaced 10 %": {"misplaced": 0.1},
    "edges misplaced 25 %": {"misplaced": 0.25},
    "Stribeck +30 %": {"push": lambda _, now: _stribeck(0.3, now)},
    "Stribeck +60 %": {"push": lambda _, now: _stribeck(0.6, now)},
    "cogging 0.3 sin 24x": {"push": lambda _, now: 0.3 * math.sin(24.0 * now.position)},
    "torque steps": {"push": _steps},
    "hand pushes": {"push": _hands},
    "square and sine": {"push": _square},
    "knocks": {"push": _knocks},
    "slow hand": {"push": lambda t, _: 8.0 * math.sin(math.tau * 0.3 * t)},
}
_OVERRIDES: Mapping[str, Sequence[str]] = {
    "nominal": (),
    "kp 1600, kd 80": ("controller.kp_1_s2=1600", "controller.kd_1_s=80"),
    **{f"plant f1 x{factor}": (f"sim.plant.f1_rad_s2={1.3 * factor}",) for factor in (0.0, 0.8, 1.2, 2.0)},
    **{f"gravity x{factor}": (f"sim.plant.gravity_rad_s2={14.03 * factor}",) for factor in (0.8, 1.2)},
    **{f"ku x{factor}": (f"sim.plant.ku_rad_s2_V={5.4 * factor}",) for factor in (0.6, 1.5)},
    "f0 f1 g +20 %, ku -20 %": (
        *("sim.plant.f0_1_s=0.12", "sim.plant.f1_rad_s2=1.56"),
        *("sim.plant.gravity_rad_s2=16.84", "sim.plant.ku_rad_s2_V=4.32"),
    ),
    "chirp": ("reference.kind=chirp", "reference.amplitude_rad=0.2", "reference.sweep_s=25"),
    "hold 0.5 rad": ("reference.kind=hold", "reference.position_rad=0.5"),
    "0.05 sin 2t": ("reference.amplitude_rad=0.05", "reference.rate_rad_s=2"),
    **{f"{counts} counts": (f"encoder.counts_per_rev={counts}",) for counts in (1024, 10000, 65536)},
    **{f"{rate} Hz": (f"loop.rate_hz={rate}",) for rate in (250, 5000)},
    **{f"encoder noise {noise} counts": (f"sim.encoder_noise_counts={noise}",) for noise in (0.3, 1.0)},
}
_IMMEDIATE_START_OVERRIDES = ("supervisor.start=immediate", "sim.position_rad=-1.57")


def hard_cases() -> Iterator[tuple[str, Rig]]:
    """Yield the acceptance rows of the friction observer that this loop can run, by name."""
    for name, overrides in _OVERRIDES.items():
        yield name, load_rig("bench-1khz", [*_IMMEDIATE_START_OVERRIDES, *overrides])
    for number, (name, what) in enumerate(_CASES.items()):
        made = {key: staticmethod(value) if callable(value) else value for key, value in what.items()}
        globals()[f"Case{number}"] = type(f"Case{number}", (Case,), made)
        yield (
            name,
            load_rig("bench-1khz", [*_IMMEDIATE_START_OVERRIDES, f"backend.kind={__name__}:Case{number}"]),
        )
    with TemporaryDirectory() as folder:
        file = Path(folder) / "two_sines.csv"
        rows = (
            f"{t:.2f},{0.6 * math.sin(1.3 * t) + 0.25 * math.sin(3.1 * t)}"
            for t in np.arange(0.0, 31.0, 0.02)
        )
        file.write_text("\n".join(("time_s,position_rad", *rows)), "utf-8")
        yield (
            "two sines",
            load_rig(
                "bench-1khz", [*_IMMEDIATE_START_OVERRIDES, "reference.kind=csv", f"reference.file={file}"]
            ),
        )


def main() -> int:
    """Run all, print what came of it; 1 if a healthy run was ended for chatter."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=6.0, help="of a healthy run")
    chosen = parser.parse_args()
    found: list[Figure] = []
    for seed in range(chosen.first, chosen.first + chosen.seeds):
        try:
            rig = load_rig("bench-1khz", healthy(seed))
        except ConfigError as error:
            sys.stdout.write(f"seed {seed} is refused: {error}\n")
            continue
        found.append(figure_of(f"seed {seed}", rig, chosen.seconds))
    hard = [figure_of(name, rig, 30.0) for name, rig in hard_cases()]
    ratios = np.array([one.ratio for one in found])
    if len(ratios):
        told = ", ".join(f"{q} % {np.percentile(ratios, q):.3f}" for q in (50, 90, 99, 100))
        sys.stdout.write(f"{len(found)} healthy runs, variation over what is allowed: {told}\n")
    for one in (*[one for one in found if one.ended_by], *hard):
        sys.stdout.write(f"{one.name:45} {one.ratio:6.3f} {one.ended_by}\n")
    false = [one for one in (*found, *hard) if one.ended_by == "chatter"]
    sys.stdout.write(f"{len(false)} ended for chatter\n")
    return bool(false)


if __name__ == "__main__":
    sys.exit(main())
