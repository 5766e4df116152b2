"""Faults of iron: encoder, motor, power stage, and people."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import deque
from typing import TYPE_CHECKING, Protocol

from dcmp_hil.values import UNKNOWN_TRUTH
from sim_backend.encoder import Encoder
from sim_backend.faults.fault_model import Choice, FaultModel, Kind, Number

if TYPE_CHECKING:
    from dcmp_hil.values import Truth
    from sim_backend.plant import Plant


class PlantFault(FaultModel):
    """Between the amplifier's output and the motor, and between the shaft and the counter."""

    def voltage(self, volts: float) -> float:
        """Return what the motor sees, V; an acceleration is that many volts."""
        return volts

    def count(self, counts: float) -> float:
        """Return what the counter shows; asked in every period, in which it is on."""
        return counts


class Acting(Protocol):
    """Protocol of a source of active plant faults."""

    @property
    def acting_on_plant(self) -> list[PlantFault]:
        """Return the plant faults that are active."""
        ...

    def tick(self) -> None:
        """Begin a period."""
        ...


class FaultyPlant:
    """A plant behind a faulty amplifier.

    Parameters
    ----------
    plant
        The plant.
    acting
        What goes wrong.
    ticking
        Whether its time is that of the faults.
    """

    def __init__(self, plant: Plant, acting: Acting, *, ticking: bool) -> None:
        self._plant, self._acting, self._ticking = plant, acting, ticking
        self.truth = UNKNOWN_TRUTH

    def advance(self, voltage: float) -> Truth:
        """Hold for a period what becomes of `voltage` (V); w of the truth has the difference."""
        if self._ticking:
            self._acting.tick()
        seen, ku = voltage, 0.0
        for effect in self._acting.acting_on_plant:
            seen, ku = effect.voltage(seen), effect.facts.believed_ku
        truth = self._plant.advance(seen)
        self.truth = truth._replace(disturbance=truth.disturbance + ku * (seen - voltage))
        return self.truth

    def stretch(self, factor: float) -> None:
        """Make one period of the plant `factor` times as long."""
        self._plant.stretch(factor)


class FaultyEncoder(Encoder):
    """An encoder whose count something happens to.

    Parameters
    ----------
    encoder
        The encoder.
    acting
        What goes wrong.
    """

    def __init__(self, encoder: Encoder, acting: Acting) -> None:
        self._encoder, self._acting = encoder, acting

    def read(self, position: float) -> float:
        """Return the measured position, rad."""
        measured = self._encoder.read(position)
        for effect in self._acting.acting_on_plant:
            measured = effect.facts.count_rad * effect.count(measured / effect.facts.count_rad)
        return measured

    def count(self, position: float) -> int:
        """Return the counter at a position (rad)."""
        count: float = self._encoder.count(position)
        for effect in self._acting.acting_on_plant:
            count = effect.count(count)
        return round(count)


class Stuck(PlantFault):
    """The encoder shows the last count for ever."""

    _shown: float | None = None

    def begin(self) -> None:
        """Forget an earlier time."""
        self._shown = None

    def count(self, counts: float) -> float:
        """Return the first count again."""
        if self._shown is None:
            self._shown = counts
        return self._shown


class Jump(PlantFault):
    """The encoder gains counts, `times` times, `every` periods apart, and they stay."""

    _age = -1

    def count(self, counts: float) -> float:
        """Return the count with the jumps so far."""
        self._age += 1
        jumps = min(self._age // round(self.number("every")) + 1, round(self.number("times")))
        return counts + jumps * round(self.number("counts"))


class Glitch(PlantFault):
    """The encoder shows a wrong count in one period of `every`."""

    _age = -1

    def count(self, counts: float) -> float:
        """Return the count, wrong in every `every`-th period."""
        self._age += 1
        ordinal, rest = divmod(self._age, round(self.number("every")))
        wrong = rest == 0 and ordinal < self.number("times")
        return counts + round(self.number("counts")) if wrong else counts


class EncoderNoise(PlantFault):
    """The encoder has Gaussian noise, in whole counts."""

    def count(self, counts: float) -> float:
        """Return the count with noise."""
        return counts + round(self.rng.gauss(0.0, self.number("counts")))


class Missed(PlantFault):
    """The encoder loses counts for ever, each with probability `p`."""

    _last: float | None = None
    _lost = 0

    def count(self, counts: float) -> float:
        """Return the count minus the lost counts."""
        moved = 0 if self._last is None else round(counts - self._last)
        self._last = counts
        lost = sum(self.rng.random() < self.number("p") for _ in range(min(abs(moved), 1000)))
        self._lost += lost if moved > 0 else -lost
        return counts - self._lost


class EncoderSign(PlantFault):
    """The encoder counts the other way from where it is."""

    _from: float | None = None

    def count(self, counts: float) -> float:
        """Return the count mirrored at where it was first."""
        if self._from is None:
            self._from = counts
        return 2.0 * self._from - counts


class Scale(PlantFault):
    """The encoder has `factor` times the counts a revolution that the rig says."""

    def count(self, counts: float) -> float:
        """Return the count of an encoder with `factor` times the resolution."""
        return math.floor(counts * self.number("factor") + 0.5)


class Gain(PlantFault):
    """The motor sees `factor` times the voltage: 0 without power, -1 with its wires swapped."""

    def voltage(self, volts: float) -> float:
        """Return the voltage times `factor`, V."""
        return volts * self.number("factor")


class Power(PlantFault):
    """The motor has no power."""

    def voltage(self, volts: float) -> float:  # noqa: ARG002
        """Return 0 V."""
        return 0.0


class MotorSign(PlantFault):
    """The motor's wires are swapped."""

    def voltage(self, volts: float) -> float:
        """Return the negated voltage, V."""
        return -volts


class Saturation(PlantFault):
    """The power stage gives no more than `V`, and the reported voltage does not show it."""

    def voltage(self, volts: float) -> float:
        """Return the voltage, limited to `V`."""
        most = self.number("V")
        return max(-most, min(most, volts))


class Offset(PlantFault):
    """The power stage adds a voltage, while it is switched on or not."""

    def voltage(self, volts: float) -> float:
        """Return the voltage plus `V`."""
        return volts + self.number("V")


class DeadBand(PlantFault):
    """The power stage gives nothing below `V`."""

    def voltage(self, volts: float) -> float:
        """Return the voltage, 0 V below `V`."""
        return 0.0 if abs(volts) < self.number("V") else volts


class Shove(PlantFault):
    """The arm is pushed, one way or the other."""

    _volts = 0.0

    def begin(self) -> None:
        """Choose a way."""
        sign = {"up": 1, "down": -1}.get(self.word("way")) or self.rng.choice((-1, 1))
        self._volts = sign * self.number("rad_s2") / self.facts.ku

    def voltage(self, volts: float) -> float:
        """Return the voltage plus the equivalent of the push, V."""
        return volts + self._volts


class Torque(PlantFault):
    """A torque acts on the arm; its course in time is the derived class's."""

    _age = -1

    def begin(self) -> None:
        """Begin its time."""
        self._age = -1

    def voltage(self, volts: float) -> float:
        """Return the voltage plus the equivalent of the torque, V."""
        self._age += 1
        return volts + self.course(self._age * self.facts.period) * self.number("rad_s2") / self.facts.ku

    @abstractmethod
    def course(self, t: float) -> float:
        """Return the torque `t` s after its begin, relative to its amplitude."""


class Push(Torque):
    """A hand pushes the arm once: half a sine."""

    def course(self, t: float) -> float:
        """Return half a sine of `ms`."""
        length = 1e-3 * self.number("ms")
        return math.sin(math.pi * t / length) if t < length else 0.0


class Sway(Torque):
    """A hand moves the arm to and fro."""

    def course(self, t: float) -> float:
        """Return a sine of `hz`."""
        return math.sin(math.tau * self.number("hz") * t)


class Square(Torque):
    """A torque that changes its sign."""

    def course(self, t: float) -> float:
        """Return the sign of a sine of `hz`."""
        return math.copysign(1.0, math.sin(math.tau * self.number("hz") * t))


class UnknownDelay(PlantFault):
    """The motor sees a voltage some periods after the reported instant."""

    def begin(self) -> None:
        """Begin with 0 V under way."""
        self._under_way = deque([0.0] * round(self.number("periods")))

    def voltage(self, volts: float) -> float:
        """Return the voltage of `periods` periods ago, V."""
        self._under_way.append(volts)
        return self._under_way.popleft()


_COUNTS = Number("counts", -1e6, 1e6, 1000)
_REPETITION_PARAMETERS = {"times": Number("", 1, 1e6, 1), "every": Number("periods", 1, 1e6, 3)}
_TORQUE_PARAMETER = {"rad_s2": Number("rad/s2", -1e5, 1e5, 8)}
_VOLTAGE_PARAMETER = {"V": Number("V", 0, 100, 1)}
PLANT = {
    "plant.enc_stuck": Kind(Stuck, "the encoder shows one position for ever"),
    "plant.enc_jump": Kind(Jump, "the count jumps, and stays", {"counts": _COUNTS, **_REPETITION_PARAMETERS}),
    "plant.enc_glitch": Kind(
        Glitch, "the count is wrong for a period", {"counts": _COUNTS, **_REPETITION_PARAMETERS}
    ),
    "plant.enc_noise": Kind(EncoderNoise, "the encoder is noisy", {"counts": Number("counts", 0, 1e4, 1)}),
    "plant.enc_missed": Kind(Missed, "counts get lost", {"p": Number("", 0, 1, 0.02)}),
    "plant.enc_sign": Kind(EncoderSign, "the encoder counts the other way"),
    "plant.cpr": Kind(Scale, "the encoder has other counts/rev", {"factor": Number("", 0.01, 100, 4)}),
    "plant.motor_sign": Kind(MotorSign, "the motor's wires are swapped"),
    "plant.power": Kind(Power, "the motor has no power"),
    "plant.gain": Kind(Gain, "the motor has another gain", {"factor": Number("", -10, 10, 0.5)}),
    "plant.saturation": Kind(Saturation, "the amplifier gives no more than this", _VOLTAGE_PARAMETER),
    "plant.offset": Kind(Offset, "the amplifier adds a voltage", {"V": Number("V", -100, 100, 1)}),
    "plant.dead_band": Kind(DeadBand, "the amplifier gives nothing below this", _VOLTAGE_PARAMETER),
    "plant.delay": Kind(
        UnknownDelay, "the motor sees a voltage later than it is reported", {"periods": Number("", 1, 100, 2)}
    ),
    "plant.push": Kind(
        Push,
        "a hand pushes the arm: half a sine",
        {**_TORQUE_PARAMETER, "ms": Number("ms", 1, 1e5, 300)},
    ),
    "plant.sway": Kind(
        Sway, "a hand moves the arm to and fro", {**_TORQUE_PARAMETER, "hz": Number("Hz", 1e-3, 1e3, 0.3)}
    ),
    "plant.square": Kind(
        Square, "a torque changes its sign", {**_TORQUE_PARAMETER, "hz": Number("Hz", 1e-3, 1e3, 0.4)}
    ),
    "plant.shove": Kind(
        Shove,
        "the arm is pushed",
        {"rad_s2": Number("rad/s2", 0, 1e5, 100), "way": Choice(("either", "up", "down"))},
    ),
}
