"""Runs under a limit in virtual time: how fast the simulated arm really is when its voltage becomes 0."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil import load_rig, loop
from dcmp_hil.assembly import assemble
from dcmp_hil.errors import DcmpError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.safety.speed_resolution import resolution
from tests.attacks.hostile.wrong_observers import KINDS

if TYPE_CHECKING:
    from dcmp_hil.backend import Backend
    from dcmp_hil.config import Rig
    from dcmp_hil.values import Sample, Truth
    from sim_backend.board.board import Board

LIMITS_RAD_S = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0)
"""rad/s."""
BY = {
    "host": ("backend.kind=sim",),
    "device": ("backend.kind=sim-board", "supervisor.monitors=finite"),
}
"""Who keeps the limit alone: the plain simulated rig has no firmware, and the host that watches for nothing
leaves it to the firmware."""
NEEDED = {("host", 2.0): 2.6, ("device", 2.0): 3.0}
"""rad/s that the arm may have at 0 V, at 4096 counts and 1 kHz."""
_MODULE = "tests.attacks.hostile.wrong_observers"
_DURATION_S, _DURATION_AFTER_S = 2.0, 0.5  # s, of an attack and of what is looked at behind its end
_HEALTHY_DURATION_S = 2.5  # s
_NOISE_SIGMAS = 4.5  # 3.2 times sqrt(2), for a difference of two: a quantile, for Gaussian noise has no bound


class Outcome(NamedTuple):
    """Result of an attack."""

    speed: float  # rad/s, of the simulated arm at the instant from which on its voltage is 0
    position: float  # rad, at the same instant
    afterwards: float  # rad/s, the fastest in the half second behind it
    reason: str  # of the end


class Witness:
    """A backend, and what was true at each tick: the voltage up to it, V, and the arm at it."""

    def __init__(self, backend: Backend) -> None:
        self._backend = backend
        self.seen: list[tuple[float, Truth]] = []
        self.write, self.truth = backend.write, backend.truth
        self._board: Board | None = getattr(backend, "board", None)
        if self._board is not None:  # its ticks go on while the host listens for something else
            self._tick, self._board.tick = self._board.tick, self._watched_tick

    def read(self) -> Sample:
        """Return the next sample."""
        sample = self._backend.read()
        if self._board is None:
            self.seen.append((sample.voltage, self._backend.truth()))
        return sample

    def _watched_tick(self) -> None:
        assert self._board is not None
        voltage = 1e-3 * self._board.applied_mV
        self._tick()
        self.seen.append((voltage, self._board.truth()))


class NoStop:
    """A stop that is never requested."""

    requested = False


def attacked(rig: Rig) -> Outcome:
    """Run a rig to its end and look at the arm at the instant from which on its voltage is 0."""
    line, _ = assemble(rig, SimulatedClock(), (), in_line=True)
    witness, reason = Witness(line.backend), "completed"
    with line.backend:
        try:
            loop.run(replace(line, backend=witness), _DURATION_S, NoStop())  # type: ignore[arg-type]
        except DcmpError as error:
            reason = getattr(error, "reason", type(error).__name__)
        for _ in range(round(_DURATION_AFTER_S / rig.period)):
            witness.write(0.0)
            witness.read()
    last = max((i for i, (voltage, _) in enumerate(witness.seen) if voltage != 0.0), default=0)
    truths = [truth for _, truth in witness.seen]
    off = truths[last]
    return Outcome(
        abs(off.velocity), off.position, max(abs(truth.velocity) for truth in truths[last:]), reason
    )


def rig_under(limit: float, seed: int, *overrides: str) -> Rig:
    """Return a rig whose arm starts anywhere, at rest; where, and its encoder, follow from the seed."""
    drawn = random.Random(f"limits {seed}")
    return load_rig(
        "bench-1khz",
        (
            "supervisor.start=immediate",
            f"supervisor.velocity_limit_rad_s={limit}",
            "encoder.zero=0",
            f"sim.seed={seed}",
            f"sim.position_rad={drawn.uniform(-3.14, 3.14):.4f}",
            f"sim.encoder_phase_counts={drawn.random():.4f}",
            f"sim.encoder_noise_counts={drawn.uniform(0.0, 0.5):.4f}",
            f"sim.plant.ku_rad_s2_V={5.4 * drawn.uniform(0.9, 1.1):.4f}",
            f"reference.rate_rad_s={drawn.uniform(0.3, 3.0):.4f}",
            f"reference.soft_start_s={drawn.uniform(0.1, 1.0):.4f}",
            *overrides,
        ),
    )


def attack(limit: float, kind: str, seed: int, by: str, *overrides: str) -> Outcome:
    """Let one kind of wrong observer lead an arm under a limit that one side keeps alone."""
    observer = f"observer.kind={_MODULE}:{KINDS[kind]}"
    return attacked(rig_under(limit, seed, observer, *BY[by], *overrides))


def most_speed(rig: Rig, by: str) -> float:
    """Return what docs/safety.md promises of the true speed at 0 V, rad/s."""
    count, period, late = rig.encoder.count, rig.period, rig.loop.delay_samples + 1
    strongest = 1.1 * rig.model.ku_rad_s2_V * rig.amplifier.limit + rig.model.gravity_rad_s2
    limit, one = rig.supervisor.velocity_limit_rad_s, resolution(count, period)
    if by == "host":
        return limit + 2.0 * one + strongest * late * period
    noise = _NOISE_SIGMAS * rig.sim.encoder_noise_counts  # counts between two samples T apart
    return limit + (3.0 + noise) * one + strongest * (0.5 * count / one + 2.0 * period)


class Healthy(NamedTuple):
    """Result of a healthy run."""

    reason: str  # "completed" if it did
    speed: float  # rad/s, the fastest that the simulated arm was
    limit: float  # rad/s

    @property
    def is_false(self) -> bool:
        """Whether it was stopped though the arm had not passed its limit."""
        return self.reason != "completed" and self.speed <= self.limit


_REFERENCES = (
    ("reference.kind=step", "reference.after_rad=1.0", "reference.at_s=0.8"),
    ("reference.kind=step", "reference.after_rad=-1.0", "reference.at_s=0.8"),
    ("reference.rate_rad_s=0.5",),
    ("reference.rate_rad_s=1.5",),
)


def healthy(seed: int) -> Healthy:
    """Run a healthy arm that starts anywhere, under limits of speed and travel, with host and device."""
    drawn = random.Random(f"healthy under limits {seed}")
    limit = 2.0 * 10.0 ** drawn.random()
    start = drawn.uniform(-3.14159, 3.14159)
    rig = load_rig(
        "bench-1khz",
        (
            "backend.kind=sim-board",
            "supervisor.start=immediate",
            "encoder.zero=0",
            f"supervisor.velocity_limit_rad_s={limit:.3f}",
            f"supervisor.position_limit_rad={drawn.uniform(3.4, 6.2832):.3f}",
            f"sim.seed={seed}",
            f"sim.position_rad={start:.5f}",
            f"sim.encoder_phase_counts={drawn.random():.4f}",
            f"sim.encoder_noise_counts={drawn.uniform(0.0, 0.5):.4f}",
            f"sim.plant.ku_rad_s2_V={5.4 * drawn.uniform(0.7, 1.4):.4f}",
            f"reference.soft_start_s={drawn.uniform(0.5, 2.0):.3f}",
            *drawn.choice(_REFERENCES),
        ),
    )
    line, _ = assemble(rig, SimulatedClock(), (), in_line=True)
    witness, reason = Witness(line.backend), "completed"
    with line.backend:
        try:
            loop.run(replace(line, backend=witness), _HEALTHY_DURATION_S, NoStop())  # type: ignore[arg-type]
        except DcmpError as error:
            reason = str(error)
    return Healthy(reason, max(abs(truth.velocity) for _, truth in witness.seen), limit)
