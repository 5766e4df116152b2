"""What the tests of the core share: rigs, cached runs, and simulated rigs that misbehave."""

from __future__ import annotations

import functools
import itertools
import math
import random
from collections import deque
from typing import TYPE_CHECKING, Any

from dcmp_hil import load_rig, run
from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.session import Session
from dcmp_hil.values import Cycle, Estimate, Reference, Sample, Timing, Truth
from sim_backend.backend import SimBackend

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.result import Result
    from dcmp_hil.telemetry.statistics import Summary
    from sim_backend.encoder import Encoder
    from sim_backend.plant import Plant

T = 1e-3  # s, the bench rig's period
STEADY = ("supervisor.start=immediate", "sim.position_rad=-1.57")
"""What the figures of docs/theory start from: the paper's pose, the trajectory at once."""

_numbers = itertools.count()


def bench(*overrides: str) -> Rig:
    """Return the shipped bench rig with overrides in dotted form."""
    return load_rig("bench-1khz", overrides)


@functools.cache
def figures(*overrides: str, duration: float = 30.13, window_from: float = 5.0) -> Summary:
    """Run the bench rig from the paper's pose in virtual time; the window of the tables is 5..30.13 s."""
    rig = bench(*STEADY, *overrides)
    return run(rig, duration=duration, fast=True, window_from=window_from).summary


def named(make: Callable[..., Any]) -> str:
    """Give a class or factory made inside a test a name that rig.toml can hold."""
    name = f"made_{next(_numbers)}"
    globals()[name] = make
    return f"{__name__}:{name}"


def known(value: float | None) -> float:
    """Return a figure; fail if it is None."""
    assert value is not None
    return value


def setting(*, period: float = T, counts: float | None = 4096.0, f0: float = 0.1) -> ObserverContext:
    """Return an observer's setting with the paper's pendulum."""
    return ObserverContext(Model(f0=f0), period, counts)


def cycle(
    t: float,
    *,
    position: float = 0.0,
    applied: float = 0.0,
    sent: float = 0.0,
) -> Cycle:
    """Return a cycle as the loop gives it to telemetry."""
    nothing = (0.0, 0.0, 0.0)
    return Cycle(
        Sample(t, position, applied), Estimate(*nothing), Reference(*nothing), sent, sent, Timing(T, 0.0, 0.0)
    )


def spoilt(sample: Sample, field: str, value: float) -> Sample:
    """Return the sample with one of its numbers replaced."""
    return Sample(**{**sample._asdict(), field: value})


def last(plant: Plant, periods: int, voltage: float = 0.0) -> Truth:
    """Let a plant run and return its last state."""
    return [plant.advance(voltage) for _ in range(periods)][-1]


class PlantSees:
    """A plant that gets another voltage than the amplifier reports."""

    def __init__(self, plant: Plant, changed: Callable[[float], float]) -> None:
        self._plant, self._changed = plant, changed

    def advance(self, voltage: float) -> Truth:
        return self._plant.advance(self._changed(voltage))

    def stretch(self, factor: float) -> None:
        self._plant.stretch(factor)


class SeenByPlant:
    """Hooks for a plant that gets another voltage than the amplifier reports."""

    def __init__(self, changed: Callable[[float], float]) -> None:
        self._changed = changed

    def plant(self, plant: Plant) -> Plant:
        return PlantSees(plant, self._changed)

    @staticmethod
    def encoder(encoder: Encoder) -> Encoder:
        return encoder


class FaultySim(SimBackend):
    """The simulated rig with a fault from `fault_at(rig)` on, drawn by `sim.seed`."""

    earliest, latest = 4.0, 4.0 + 4.0 * math.pi  # s: one period of sin(t/2), after the soft start

    def __init__(self, rig: Rig, clock: Clock) -> None:
        super().__init__(rig, clock, SeenByPlant(lambda v: v if self._t < self.fault_at else self.seen(v)))
        self.fault_at = self.instant(rig)
        self._t = 0.0

    @classmethod
    def instant(cls, rig: Rig) -> float:
        """Return when the fault begins, s."""
        return random.Random(rig.sim.seed).uniform(cls.earliest, cls.latest)

    def seen(self, voltage: float) -> float:
        """Return what the motor gets of a voltage while the fault is on, V."""
        return voltage

    def read(self) -> Sample:
        sample = super().read()
        self._t = sample.t
        return sample


class StuckEncoder(FaultySim):
    """Shows the last good position for ever."""

    _last = 0.0

    def read(self) -> Sample:
        sample = super().read()
        if sample.t >= self.fault_at:
            return sample._replace(position=self._last)
        self._last = sample.position
        return sample


class LostPower(FaultySim):
    """The voltage is reported, and never reaches the motor."""

    def seen(self, voltage: float) -> float:  # noqa: ARG002
        return 0.0


class Reversed(FaultySim):
    """A plant whose motor turns in the wrong direction."""

    def seen(self, voltage: float) -> float:
        return -voltage


class ReversedFromTheStart(Reversed):
    """The motor was wired the wrong way round."""

    earliest = latest = 0.0


class DeadFromTheStart(LostPower):
    """The motor has no power at all."""

    earliest = latest = 0.0


class BlindFromTheStart(StuckEncoder):
    """The encoder never moves."""

    earliest = latest = 0.0


class DelayedPlant(SimBackend):
    """The voltage reaches the motor some periods later than the rig says."""

    periods = 0

    def __init__(self, rig: Rig, clock: Clock) -> None:
        waiting = deque([0.0] * self.periods)

        def later(voltage: float) -> float:
            waiting.append(voltage)
            return waiting.popleft()

        super().__init__(rig, clock, SeenByPlant(later))


class DemandedVoltage(SimBackend):
    """An amplifier that saturates at 10 V and reports what it was asked for: the mistake of theory 3.1.

    The rig must say `amplifier.voltage_limit_V = "none"`, or the host would clamp first.
    """

    def __init__(self, rig: Rig, clock: Clock) -> None:
        clamped = rig.amplifier.model_copy(update={"voltage_limit_V": 10.0})
        super().__init__(rig.model_copy(update={"amplifier": clamped}), clock)
        self._asked = [0.0, 0.0]

    def write(self, voltage: float) -> None:
        super().write(voltage)
        self._asked = [self._asked[1], voltage]

    def read(self) -> Sample:
        return super().read()._replace(voltage=self._asked[0])


class LosesSamples(SimBackend):
    """A backend that loses one sample in twenty."""

    def __init__(self, rig: Rig, clock: Clock) -> None:
        super().__init__(rig, clock)
        self._rng = random.Random(rig.sim.seed)

    def read(self) -> Sample:
        sample = super().read()
        while self._rng.random() < 0.05:
            sample = super().read()
        return sample


class IgnoresGaps:
    """The default observer, made to believe that every sample comes one period after the last."""

    def __init__(self, setting: ObserverContext) -> None:
        self._observer, self._period, self._ticks = SuperTwisting(setting), setting.period, 0

    def update(self, sample: Sample) -> Estimate:
        self._ticks += 1
        return self._observer.update(sample._replace(t=self._ticks * self._period))


class HeldRun:
    """A run in virtual time whose backend the test holds in its hands.

    Parameters
    ----------
    overrides
        Of the bench rig.
    duration
        s.
    on_read
        Called with the number of the sample (from 0) and the sample; returns the sample to pass on.
    base
        The simulated rig.
    session
        Further arguments of Session.
    """

    def __init__(
        self,
        *overrides: str,
        duration: float = 1.0,
        on_read: Callable[[int, Sample], Sample] | None = None,
        on_write: Callable[[float], None] | None = None,
        base: type[SimBackend] = SimBackend,
        **session: Any,
    ) -> None:
        held = self
        self.reads = 0
        self.written: list[float] = []

        class Held(base):  # type: ignore[misc, valid-type]
            def __init__(self, rig: Rig, clock: Clock) -> None:
                super().__init__(rig, clock)
                held.backend = self

            def read(self) -> Sample:
                sample: Sample = super().read()
                held.reads += 1
                return on_read(held.reads - 1, sample) if on_read else sample

            def write(self, voltage: float) -> None:
                if on_write:
                    on_write(voltage)
                super().write(voltage)
                held.written.append(voltage)

        self.backend: SimBackend
        rig = bench(f"backend.kind={named(Held)}", *overrides)
        self.session = Session(rig, duration=duration, fast=True, **session)

    def run(self) -> Result:
        """Run to the end and return the result."""
        self.session.run()
        return self.session.result()
