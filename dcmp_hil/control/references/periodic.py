"""References that swing: a sine and a chirp."""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from dcmp_hil.common.fast_tuple import make
from dcmp_hil.common.section import NotNegative, Positive
from dcmp_hil.control.references import Peaks, References, ReferenceSettings
from dcmp_hil.values import Reference

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Vector = NDArray[np.float64]


_PROBED_ANGLES = 4096


def _sine_and_cosine(angle: Vector) -> tuple[Vector, Vector]:
    """Return both, with the bits of `math`."""
    return (np.sin(angle), np.cos(angle)) if _numpy_is_math() else _by_math(angle)


def _by_math(angle: Vector) -> tuple[Vector, Vector]:
    angles = angle.tolist()
    count = len(angles)
    return np.fromiter(map(math.sin, angles), float, count), np.fromiter(map(math.cos, angles), float, count)


@cache
def _numpy_is_math() -> bool:
    """Return whether the functions of numpy have the bits of `math` here.

    Both are those of the C library, ten times as fast, or numpy has its own for the processor. Those differ
    in the last bit of one value in ten.
    """
    angles = np.concatenate([np.linspace(-size, size, _PROBED_ANGLES) for size in (1.0, 10.0, 1e3)])
    pairs = zip((np.sin(angles), np.cos(angles)), _by_math(angles), strict=True)
    return all(bool((one == other).all()) for one, other in pairs)


class SineWave(NamedTuple):
    """A sine as plain numbers, for the loop.

    An attribute of a pydantic model takes 47 ns to read, one of a plain object 14, and a cycle needs five.
    """

    amplitude: float  # rad
    rate: float  # rad/s
    phase: float  # rad
    offset: float  # rad

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""
        amplitude, rate, phase, offset = self
        angle = rate * t + phase
        swing = amplitude * math.sin(angle)
        # 0.09 us less than the constructor
        return make(Reference, (offset + swing, amplitude * rate * math.cos(angle), -rate * rate * swing))


class Sine(ReferenceSettings):
    """x_r = offset + amplitude sin(rate t + phase); the defaults are the paper's sin(t/2)."""

    kind: Literal["sine"] = "sine"
    amplitude_rad: NotNegative = 1.0
    """Amplitude, rad."""
    rate_rad_s: Positive = 0.5
    """Angular frequency, rad/s."""
    phase_rad: float = 0.0
    """Phase at the start, rad."""
    offset_rad: float = 0.0
    """Middle of the swing, rad; 0 = hanging."""

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""
        return self.source().at(t)

    def source(self) -> SineWave:
        """Return the sine without pydantic, for the loop."""
        return SineWave(self.amplitude_rad, self.rate_rad_s, self.phase_rad, self.offset_rad)

    def at_each(self, t: Vector) -> References:
        """Return the references at many instants, s after the start."""
        amplitude, rate, phase, offset = self.source()
        sine, cosine = _sine_and_cosine(rate * t + phase)
        swing = amplitude * sine
        return References(offset + swing, amplitude * rate * cosine, -rate * rate * swing)

    def peaks(self, length: float) -> Peaks:  # noqa: ARG002 - at some time it asks for all of it
        """Return what it asks for at most."""
        amplitude, rate = self.amplitude_rad, self.rate_rad_s
        return Peaks(abs(self.offset_rad) + amplitude, amplitude * rate, amplitude * rate * rate)


class Chirp(ReferenceSettings):
    """A sine whose frequency rises linearly over `sweep_s` and then stays."""

    kind: Literal["chirp"]
    amplitude_rad: NotNegative = 0.5
    """Amplitude, rad."""
    from_hz: NotNegative = 0.1
    """Frequency at the start, Hz."""
    to_hz: Positive = 1.0
    """Frequency at the end of the sweep, Hz."""
    sweep_s: Positive = 20.0
    """Length of the sweep, s."""
    offset_rad: float = 0.0
    """Middle of the swing, rad; 0 = hanging."""

    def at(self, t: float) -> Reference:
        """Return the reference `t` seconds after the start."""
        slope = (self.to_hz - self.from_hz) / self.sweep_s if t < self.sweep_s else 0.0
        swept = min(t, self.sweep_s)
        turns = swept * (self.from_hz + 0.5 * (self.to_hz - self.from_hz) * swept / self.sweep_s)
        angle = 2 * math.pi * (turns + self.to_hz * (t - swept))
        rate = 2 * math.pi * (self.from_hz + slope * t if t < self.sweep_s else self.to_hz)
        sine, cosine = self.amplitude_rad * math.sin(angle), self.amplitude_rad * math.cos(angle)
        return Reference(
            self.offset_rad + sine, rate * cosine, 2 * math.pi * slope * cosine - rate * rate * sine
        )

    def at_each(self, t: Vector) -> References:
        """Return the references at many instants, s after the start."""
        sweeps = t < self.sweep_s
        slope = np.where(sweeps, (self.to_hz - self.from_hz) / self.sweep_s, 0.0)
        swept = np.minimum(t, self.sweep_s)
        turns = swept * (self.from_hz + 0.5 * (self.to_hz - self.from_hz) * swept / self.sweep_s)
        sine, cosine = _sine_and_cosine(2 * math.pi * (turns + self.to_hz * (t - swept)))
        rate = 2 * math.pi * np.where(sweeps, self.from_hz + slope * t, self.to_hz)
        sine, cosine = self.amplitude_rad * sine, self.amplitude_rad * cosine
        return References(
            self.offset_rad + sine, rate * cosine, 2 * math.pi * slope * cosine - rate * rate * sine
        )

    def peaks(self, length: float) -> Peaks:  # noqa: ARG002 - a sweep is judged as a whole
        """Return what it asks for at most."""
        amplitude = self.amplitude_rad
        rate = math.tau * max(self.from_hz, self.to_hz)
        slope = math.tau * abs(self.to_hz - self.from_hz) / self.sweep_s
        farthest = abs(self.offset_rad) + amplitude
        return Peaks(farthest, amplitude * rate, amplitude * max(rate * rate, slope))
