"""Shadow mode: an observer that computes on the samples of a run, and acts on nothing."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.values import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.control.controllers import Controller
    from dcmp_hil.control.observers import Observer, Predictor
    from dcmp_hil.values import Cycle, Estimate, Reference, Sample

    Values = tuple[float, float, float, float]
    """Position (rad), velocity (rad/s), disturbance (rad/s2), voltage that it would demand (V)."""

_NO_VALUES = (math.nan, math.nan, math.nan, math.nan)


class Shadow:
    """An observer beside the one that closes the loop, on the same samples.

    It has its own predictor, which is told the voltage that was really sent. Where it fails, it is NaN from
    then on: the loop never reads what it returns.

    Parameters
    ----------
    name
        In columns and messages, such as ``kalman``.
    observer, predictor
        Of its own.
    controller
        That of the loop, so that its present gains count; it must keep no state of its own. None for a
        controller that may: there is no demand then.

    Attributes
    ----------
    failure
        Why it gave up; empty while it has not.
    """

    def __init__(
        self, name: str, observer: Observer, predictor: Predictor, controller: Controller | None = None
    ) -> None:
        self.name, self.failure = name, ""
        self._observer, self._predictor, self._controller = observer, predictor, controller

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns, with their units; without a controller there is no demand."""
        estimate = f"position_{self.name}_rad", f"velocity_{self.name}_rad_s"
        disturbance, demand = f"disturbance_{self.name}_rad_s2", f"voltage_demand_{self.name}_V"
        return (*estimate, disturbance, *((demand,) if self._controller else ()))

    def update(self, sample: Sample, reference: Reference, voltage: float) -> Values:
        """Take the next sample, and return what this observer makes of it.

        Parameters
        ----------
        sample
            As the loop's observer got it.
        reference
            At the instant at which the command of this cycle acts.
        voltage
            V, that was really sent.
        """
        if self.failure:
            return _NO_VALUES
        try:
            estimate = self._observer.update(sample)
            demand = math.nan
            if self._controller is not None:
                ahead = self._predictor.ahead(sample, estimate, reference)
                demand = self._controller.update(reference, ahead)
                self._predictor.sent(voltage)
            x1, x2, w = estimate
            known = x1 + x2 + w if self._controller is None else x1 + x2 + w + demand
            if math.isfinite(known):
                return x1, x2, w, demand
            self.failure = self._why_not_finite(sample, estimate)
        except Exception as error:  # noqa: BLE001 - after any exception of a shadow, the run goes on
            self.failure = f"it raised {type(error).__name__}: {error}"
        return _NO_VALUES

    def _why_not_finite(self, sample: Sample, estimate: Estimate) -> str:
        """Return the reason of a class of the user's own, if it states one."""
        check = getattr(self._observer, "check", None)
        request = check(sample, estimate) if check else None
        return str(request.error()) if request else "its estimate is not finite"


class Shadows:
    """The shadows of a run as further columns of its cycles, asked for when the command has left.

    Parameters
    ----------
    shadows
        Each with a name of its own.

    Attributes
    ----------
    names
        Of the values.
    """

    def __init__(self, shadows: Sequence[Shadow] = ()) -> None:
        self._shadows = [(shadow, len(shadow.names)) for shadow in shadows]
        self.names = tuple(name for shadow in shadows for name in shadow.names)
        self._events: list[Event] = []

    def values(self, cycle: Cycle) -> tuple[float, ...]:
        """Return the values of every shadow for a cycle."""
        sample, _, reference, _, voltage, _ = cycle
        found: list[float] = []
        for shadow, count in self._shadows:
            working = not shadow.failure
            found += shadow.update(sample, reference, voltage)[:count]
            if working and shadow.failure:
                self._events.append(_gave_up(shadow, sample.t))
        return tuple(found)

    def events(self) -> Sequence[Event]:
        """Return what happened since the last call."""
        told, self._events = self._events, []
        return told


def _gave_up(shadow: Shadow, t: float) -> Event:
    return Event(
        t,
        "WARN",
        EventKind.TELEMETRY,
        f"{shadow.name}, which runs beside the loop only, gave up: {shadow.failure.rstrip('.')}. The run "
        "goes on; its columns have no numbers from here on.",
    )
