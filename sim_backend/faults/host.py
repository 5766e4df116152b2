"""Faults of a host: numbers that are none, code that raises, and time that passes unnoticed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from sim_backend.faults.fault_model import Choice, FaultModel, Kind, Number

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.values import Estimate, Sample

_NUMBERS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


class InjectedError(Exception):
    """Exception of `host.raise`, as by a bug in a user's controller."""


class InjectedBaseError(BaseException):
    """The same, beyond `except Exception`."""


class HostFault(FaultModel):
    """Between the stages of a period."""

    elapse: Callable[[float], None]
    """Lets time pass, s, without the host noticing; the injector sets it."""

    def sample(self, sample: Sample) -> Sample:
        """Return the sample that the loop gets."""
        return sample

    def estimate(self, estimate: Estimate) -> Estimate:
        """Return the estimate that the loop gets from its observer."""
        return estimate

    def demand(self, demand: float) -> float:
        """Return the controller's voltage demand that the loop gets, V."""
        return demand


class Spoil(HostFault):
    """One value of the cycle becomes NaN or infinite."""

    def sample(self, sample: Sample) -> Sample:
        """Return the sample with one value replaced by NaN or infinity."""
        return sample._replace(**self._spoilt("sample"))

    def estimate(self, estimate: Estimate) -> Estimate:
        """Return the estimate with x1, x2 or w spoilt."""
        return estimate._replace(**self._spoilt("estimate"))

    def demand(self, demand: float) -> float:
        """Return the spoilt demand, V."""
        return self._value if self.word("where") == "demand" else demand

    @property
    def _value(self) -> float:
        return _NUMBERS[self.word("value")]

    def _spoilt(self, stage: str) -> dict[str, Any]:
        where, _, name = self.word("where").partition(".")
        return {name: self._value} if where == stage else {}


class Raise(HostFault):
    """Observer or controller raises."""

    def estimate(self, estimate: Estimate) -> Estimate:
        """Raise the injected exception in place of an estimate."""
        if self.word("where") == "observer":
            self._raise()
        return estimate

    def demand(self, demand: float) -> float:
        """Raise the injected exception in place of a demand."""
        if self.word("where") == "controller":
            self._raise()
        return demand

    def _raise(self) -> None:
        kinds = {"exception": InjectedError, "base": InjectedBaseError}
        raise kinds[self.word("what")](f"injected: {self.word('where')}")


class Diverge(HostFault):
    """The observer's estimate grows without bound, as with a wrong gain."""

    _factor = 1.0

    def estimate(self, estimate: Estimate) -> Estimate:
        """Return the estimate, further away every period."""
        self._factor *= self.number("factor")
        grown = self._factor - 1.0
        x1, x2, w = estimate
        return estimate._replace(position=x1 + 1e-3 * grown, velocity=x2 + grown, disturbance=w + grown)


class Switch(HostFault):
    """The controller switches between two voltages, as a sign() without a boundary layer does."""

    _periods = 0

    def demand(self, demand: float) -> float:  # noqa: ARG002 - it asks for something else
        """Return the two voltages in turn, V."""
        self._periods += 1
        up = self._periods // round(self.number("every")) % 2
        return self.number("V") if up else -self.number("V")


class Slow(HostFault):
    """The controller takes its time, now and then, or `times` times at the most."""

    _left: int | None = None

    def demand(self, demand: float) -> float:
        """Return the demand, later."""
        left = round(self.number("times")) if self._left is None else self._left
        if left and self.rng.random() < self.number("p"):
            left -= 1
            self.elapse(1e-3 * self.number("ms") * (1.0 + self.number("more") * self.rng.random()))
        self._left = left
        return demand


class Late(Slow):
    """The host wakes up late, before it reads the sample."""

    def sample(self, sample: Sample) -> Sample:
        """Sleep on; the sample is an old one when it is used."""
        super().demand(0.0)
        return sample

    def demand(self, demand: float) -> float:
        """Return the demand in time."""
        return demand


def _pauses(ms: float, times: float, p: float = 1.0) -> dict[str, Number | Choice]:
    return {
        "ms": Number("ms", 0.01, 1000, ms),
        "more": Number("", 0, 100, 0),
        "times": Number("", 1, 1e6, times),
        "p": Number("", 0, 1, p),
    }


_STAGES = (
    *("sample.position", "sample.voltage", "sample.t"),
    *("estimate.position", "estimate.velocity", "estimate.disturbance", "demand"),
)
HOST = {
    "host.spoil": Kind(
        Spoil, "a number is none", {"where": Choice(_STAGES), "value": Choice(tuple(_NUMBERS))}
    ),
    "host.raise": Kind(
        Raise,
        "observer or controller raises",
        {"where": Choice(("controller", "observer")), "what": Choice(("exception", "base"))},
    ),
    "host.diverge": Kind(Diverge, "the observer diverges", {"factor": Number("", 1.001, 10, 1.5)}),
    "host.chatter": Kind(
        Switch, "the controller switches", {"V": Number("V", 0, 1000, 10), "every": Number("", 1, 1000, 1)}
    ),
    "host.slow": Kind(Slow, "the controller is slow", _pauses(2, 1e6)),
    "host.delay": Kind(Late, "the host wakes up late", _pauses(3, 1)),
    "host.pauses": Kind(Slow, "the host stands still now and then", _pauses(20, 1e6, 0.01)),
}
