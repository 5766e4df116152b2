"""Stages of the user's own, with what they return checked once a cycle.

An observer or a controller that raises, or returns what it may not, goes on as NaN, and its `check` names
class, file and line: the supervisor asks it in the same cycle and sends 0 V.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from dcmp_hil.errors import DcmpError
from dcmp_hil.platform.stop_request import Interrupted
from dcmp_hil.plugins.error_text import REMEDY, at, file_of, message_of, place_of, place_of_code, shown_value
from dcmp_hil.plugins.numbers import plain_number
from dcmp_hil.trip_request import TripRequest
from dcmp_hil.values import Estimate, Sample

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.values import Reference

_NO_ESTIMATE = Estimate(math.nan, math.nan, math.nan)


class CheckedObserver:
    """An observer of the user's own.

    Parameters
    ----------
    inner
        The observer.
    name
        `module:Class`, for the message.

    Attributes
    ----------
    inner
        As given.
    """

    def __init__(self, inner: Any, name: str) -> None:
        self.inner, self._name = inner, name
        self._update: Callable[[Sample], Estimate] = inner.update
        self._failure: TripRequest | None = None

    def update(self, sample: Sample) -> Estimate:
        """Return the estimate at `sample.t`; NaN if the observer raises, or returns none of numbers."""
        try:
            estimate = self._update(sample)
        except (DcmpError, Interrupted):
            raise
        except BaseException as error:  # noqa: BLE001 - after any exception, the cycle ends at 0 V
            self._failure = self._failure or _raised(self._name, self._update, error, sample.t)
            return _NO_ESTIMATE
        if type(estimate) is Estimate:
            x1, x2, w = estimate
            if type(x1) is type(x2) is type(w) is float and -math.inf < x1 + x2 + w < math.inf:
                return estimate
        return self._converted(estimate, sample.t)

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:  # noqa: ARG002 - as every check
        """Object if it has failed, for the reason for which it failed first."""
        return self._failure

    def _converted(self, estimate: Any, t: float) -> Estimate:
        """Return an estimate of plain floats, also from numpy's; note a failure for other types."""
        expected = "Estimate(position, velocity, disturbance), three numbers"
        if isinstance(estimate, Estimate):
            numbers = [number for value in estimate if (number := plain_number(value)) is not None]
            if len(numbers) == len(estimate):
                made = Estimate(*numbers)
                if not all(math.isfinite(number) for number in numbers):
                    self._failure = self._failure or _not_finite(self._name, self._update, made, t)
                return made
        self._failure = self._failure or _wrong(self._name, self._update, estimate, expected, t)
        return _NO_ESTIMATE


class CheckedController:
    """A controller of the user's own.

    Parameters
    ----------
    inner
        The controller.
    name
        `module:Class`, for the message.

    Attributes
    ----------
    inner
        As given.
    """

    def __init__(self, inner: Any, name: str) -> None:
        self.inner, self._name = inner, name
        self._update: Callable[[Reference, Estimate], float] = inner.update
        self._failure: TripRequest | None = None

    def update(self, reference: Reference, estimate: Estimate) -> float:
        """Return the voltage to ask for, V; NaN if the controller raises, or returns no number."""
        try:
            voltage = self._update(reference, estimate)
        except (DcmpError, Interrupted):
            raise
        except BaseException as error:  # noqa: BLE001 - after any exception, the cycle ends at 0 V
            self._failure = self._failure or _raised(self._name, self._update, error)
            return math.nan
        if type(voltage) is float and -math.inf < voltage < math.inf:
            return voltage
        number = plain_number(voltage)
        if number is None:
            expected = "a voltage, one number"
            self._failure = self._failure or _wrong(self._name, self._update, voltage, expected)
            return math.nan
        if not math.isfinite(number):
            self._failure = self._failure or _not_finite(self._name, self._update, number)
        return number

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:  # noqa: ARG002 - as every check
        """Object if it has failed, for the reason for which it failed first."""
        return self._failure


def failure_of(stage: object) -> TripRequest | None:
    """Return why a stage failed, where it is one of the user's own; None while it has not."""
    check: Callable[[Sample, Estimate], TripRequest | None] | None = getattr(stage, "check", None)
    return check(Sample(math.nan, math.nan, math.nan), _NO_ESTIMATE) if check else None


def _raised(
    name: str, method: Callable[..., Any], error: BaseException, t: float | None = None
) -> TripRequest:
    where = place_of(error, file_of(method)) or place_of_code(method)
    sentence = f"{name} raised {message_of(error)}{at(where)}{_when(t)}."
    return TripRequest("plugin", sentence, REMEDY, cause=error)  # for Python, which shows the traceback


def _wrong(
    name: str, method: Callable[..., Any], value: object, expected: str, t: float | None = None
) -> TripRequest:
    where = at(place_of_code(method))
    sentence = f"{name}.update returned {shown_value(value)}{where}{_when(t)}; expected {expected}."
    return TripRequest("plugin", sentence, REMEDY)


def _not_finite(name: str, method: Callable[..., Any], value: object, t: float | None = None) -> TripRequest:
    return TripRequest(
        "not_finite",
        f"{name}.update returned {shown_value(value)}{at(place_of_code(method))}{_when(t)}.",
        "Look for a division by zero, a missing value, or a gain that makes it diverge.",
    )


def _when(t: float | None) -> str:
    return "" if t is None else f" at t = {t:.3f} s"
