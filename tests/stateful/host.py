"""The host's side of a run: a backend that is open, a supervisor, and what must hold of the two."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.safety.limiter import Limiter
from dcmp_hil.safety.monitors import FiniteMonitor
from dcmp_hil.safety.supervisor import Phase, Supervisor
from dcmp_hil.trip_request import TripRequest, Urgency
from dcmp_hil.values import Estimate, Event, Fault, PhaseData, Sample

if TYPE_CHECKING:
    from dcmp_hil.device.backend import DeviceBackend
    from tests.stateful.judge import Judge

SETTLE_TIME_S, ENGAGE_TIME_S, STOP_TIME_S = 0.005, 0.01, 0.05  # s
VOLTAGE_MAX_V = 10.0  # V
PERIOD_S = 1e-3  # s
_ORDER = list(Phase)  # a run goes down this list, and never up
_POWERLESS = {Phase.ARMING, Phase.SETTLING, Phase.TRIPPED}


class Objector:
    """A monitor that objects when it is told to."""

    objects = False

    def check(self, sample: Sample, estimate: Estimate) -> TripRequest | None:  # noqa: ARG002
        return TripRequest("test", "told to", "") if self.objects else None


class Host:
    """A host whose device has just been armed."""

    def __init__(self, backend: DeviceBackend, judge: Judge, session: int) -> None:
        self.backend, self.judge, self.session = backend, judge, session
        self.objector = Objector()
        limiter = Limiter(voltage=VOLTAGE_MAX_V, period=PERIOD_S, notify=self._notified)
        monitors = (FiniteMonitor(), self.objector)
        self.supervisor = Supervisor(
            monitors, limiter, settle=SETTLE_TIME_S, engage=ENGAGE_TIME_S, notify=self._notified
        )
        self.sample = Sample(-math.inf, 0.0, 0.0)
        self._phase, self._since = Phase.ARMING, 0.0

    @property
    def over(self) -> TripRequest | None:
        """Why the run is over; None while it is not."""
        return self.supervisor.over

    @property
    def has_authority(self) -> bool:
        """Whether the run is where a start leads to."""
        return self.supervisor.phase is Phase.RUNNING

    def period(self, demand: float) -> None:
        """Run one cycle as `dcmp_hil.loop` does."""
        sample = self.backend.read()
        if not sample.t > self.sample.t:
            self.judge.note(f"time goes from {self.sample.t} s to {sample.t} s")
        self.sample = sample
        self.supervisor.engages(sample)
        voltage = self.supervisor.safe_voltage(sample, self._estimate, demand)
        self.judge.wrote(voltage)
        self._look(voltage, demand)
        self.backend.write(voltage)

    def look_after_trip(self, demand: float) -> None:
        """Make a supervisor that has tripped go on: it must not."""
        later = self.sample._replace(t=self.sample.t + 1.0, fault=Fault.NONE)
        self.objector.objects = False
        for urgency in Urgency:
            self.supervisor.stop(TripRequest("test", "once more", "", urgency), later.t)
        began = self.supervisor.engages(later)
        voltage = self.supervisor.safe_voltage(later, self._estimate, demand)
        if began or voltage != 0.0 or self.supervisor.phase is not Phase.TRIPPED:
            self.judge.note(f"{voltage} V in phase {self.supervisor.phase} after a trip")

    @property
    def _estimate(self) -> Estimate:
        return Estimate(self.sample.position, 0.0, 0.0)

    def _look(self, voltage: float, demand: float) -> None:
        phase, gone = self.supervisor.phase, self.sample.t - self._since
        if not abs(voltage) <= self._most(phase, gone):
            self.judge.note(f"{voltage} V in {phase}, {gone} s after it began")
        if phase is Phase.STOPPING and gone > STOP_TIME_S + 1e-9:
            self.judge.note(f"{phase} for {gone} s")
        ended = self.sample.fault != Fault.NONE or self.objector.objects or not math.isfinite(demand)
        if ended and (phase is not Phase.TRIPPED or voltage != 0.0):
            self.judge.note(f"{voltage} V in {phase}: fault {self.sample.fault}, demand {demand}")

    def _most(self, phase: Phase, gone: float) -> float:
        if phase in _POWERLESS:
            return 0.0
        if phase is Phase.ENGAGING:
            return VOLTAGE_MAX_V * gone / ENGAGE_TIME_S + 1e-9
        return (
            VOLTAGE_MAX_V * max(0.0, 1.0 - gone / STOP_TIME_S) + 1e-9
            if phase is Phase.STOPPING
            else VOLTAGE_MAX_V
        )

    def _notified(self, event: Event) -> None:
        if not isinstance(event.data, PhaseData):
            return
        phase = Phase(event.data.phase)
        if _ORDER.index(phase) <= _ORDER.index(self._phase):
            self.judge.note(f"from {self._phase} to {phase}")
        self._phase, self._since = phase, event.t
