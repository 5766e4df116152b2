"""A recording in the place of a device: the loop's own line reads its samples, and what was decided then."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Self

from dcmp_hil.ipc.mailbox import APPLIED
from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.recording.recorded_changes import UnrepeatedChange
from dcmp_hil.values import Reference, Sample, Truth

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import TracebackType

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.control.change import Change
    from dcmp_hil.control.trajectory import Trajectory
    from dcmp_hil.ipc.mailbox import Mailbox
    from dcmp_hil.live.live_changes import LiveChanges
    from dcmp_hil.safety.polarity_check import MotorGain
    from dcmp_hil.trip_request import TripRequest
    from dcmp_hil.values import Cycle, Estimate

_FIELD_NUMBERS = {name: number for number, name in enumerate(FIELDS)}
_T, _AHEAD, _SENT = (_FIELD_NUMBERS[name] for name in ("t", "position_ahead", "voltage_sent"))
_TRUE, _BEGAN = (_FIELD_NUMBERS[name] for name in ("position_true", "began"))


class ReplayBackend:
    """The samples of a recorded run. Samples that were lost, or left out as outliers, are missing here too.

    Parameters
    ----------
    rows
        Shape (n, len(FIELDS) or more), as `RecordedRun.rows`.

    Attributes
    ----------
    row
        The recorded cycle of the last sample, by `FIELDS`.
    requested
        Whether the last sample was read: this backend is the loop's StopFlag as well.
    """

    simulated = True

    def __init__(self, rows: NDArray[np.float64]) -> None:
        self._rows = deque(rows.tolist())
        self.row: list[float] = [math.nan] * len(FIELDS)
        self.requested = not self._rows

    def __enter__(self) -> Self:
        """Return the backend: there is no device to open."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Do nothing: there is no device to drive to 0 V."""

    def read(self) -> Sample:
        """Return the next sample; there must be one."""
        self.row = row = self._rows.popleft()
        self.requested = not self._rows
        t, position, voltage, fault = row[_T : _T + len(Sample._fields)]
        return Sample(t, position, voltage, int(fault))

    def write(self, voltage: float) -> None:
        """Drop the voltage: the recorded arm has moved already."""

    def truth(self) -> Truth:
        """Return the recorded truth of the last sample; NaN of a real device."""
        return Truth(*self.row[_TRUE : _TRUE + len(Truth._fields)])


class RecordedTrajectory:
    """The references of a recorded run, in the place of the trajectory.

    Parameters
    ----------
    backend
        Its last sample says which cycle it is.
    inner
        Led through what happened to it: held, begun, lowered. Friction and changes are told from it.
    """

    def __init__(self, backend: ReplayBackend, inner: Trajectory) -> None:
        self._backend, self._inner = backend, inner
        self.hold, self.lower, self.velocity = inner.hold, inner.lower, inner.velocity

    def begin(self, t: float, position: float) -> None:  # noqa: ARG002 - as Trajectory's
        """Begin when the recorded one did: before `t` where that cycle itself is missing."""
        self._inner.begin(self._backend.row[_BEGAN], position)

    def at(self, t: float) -> Reference:  # noqa: ARG002 - as Trajectory's
        """Return the recorded reference of this cycle."""
        return Reference(*self._backend.row[_AHEAD : _AHEAD + len(Reference._fields)])


class RecordedSupervisor:
    """The decisions of a recorded run, in the place of the supervisor.

    Parameters
    ----------
    backend
        Its last sample says which cycle it is.
    """

    over: TripRequest | None = None
    stopping = False
    motor_gain: MotorGain | None = None

    def __init__(self, backend: ReplayBackend) -> None:
        self._backend = backend
        self._began = math.inf

    def engages(self, sample: Sample) -> bool:
        """Return whether the trajectory began in this cycle, or in one before it that is missing."""
        began = self._backend.row[_BEGAN]
        if not began <= sample.t or began == self._began:
            return False
        self._began = began
        return True

    def limit_reference(self, sample: Sample, reference: Reference) -> Reference:  # noqa: ARG002
        """Return the reference: the recorded one was limited."""
        return reference

    def safe_voltage(self, sample: Sample, estimate: Estimate, demand: float) -> float:  # noqa: ARG002
        """Return the voltage that was sent, V."""
        return self._backend.row[_SENT]

    def stop(self, cause: TripRequest, t: float) -> None:
        """Do nothing: the recording says where the run ended."""


class RepeatedChanges:
    """The changes of a recorded run, each made in its cycle.

    Parameters
    ----------
    made
        Device time, s, and change, in order.
    mailbox
        Where they are put.
    changes
        Takes them from there.

    Attributes
    ----------
    refused
        What observer, controller or trajectory could not apply.
    """

    def __init__(self, made: Iterable[tuple[float, Change]], mailbox: Mailbox, changes: LiveChanges) -> None:
        self._made, self._mailbox, self._changes = deque(made), mailbox, changes
        self.refused: list[UnrepeatedChange] = []

    def apply(self, t: float) -> None:
        """Make the change of this cycle: later where the cycle itself is missing."""
        if not (self._made and self._made[0][0] <= t):
            self._changes.apply(t)
            return
        was, change = self._made.popleft()
        number = self._mailbox.put(change)
        self._changes.apply(t)
        answer = self._mailbox.answer(number)
        if answer is None or answer.what != APPLIED:
            self.refused.append(UnrepeatedChange(was, change.values, "refused", "It could not be applied."))


class ReplayTelemetry:
    """Telemetry of a repetition: estimates and demands, cycle by cycle.

    Attributes
    ----------
    estimates
        Of the observer.
    demands
        V, of the controller.
    """

    def __init__(self) -> None:
        self.estimates: list[Estimate] = []
        self.demands: list[float] = []

    def record(self, cycle: Cycle) -> None:
        """Keep what was said in one cycle."""
        self.estimates.append(cycle.estimate)
        self.demands.append(cycle.demand)
