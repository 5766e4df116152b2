"""Events and requests to trip, made of the numbers that the core gives."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.safety import polarity_refusals as probe
from dcmp_hil.safety.chatter import cause_of, chattering
from dcmp_hil.safety.diagnosis import Diagnosis
from dcmp_hil.safety.limiter import astray, limit_event, saturated
from dcmp_hil.safety.monitors import WATCHING_OBSERVER, not_finite, too_far, too_fast, unknown_forces
from dcmp_hil.safety.outlier_filter import jumped
from dcmp_hil.safety.polarity_check import MotorGain
from dcmp_hil.safety.supervisor import Phase, not_finite_demand, phase_event

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.safety.diagnosis import Finding
    from dcmp_hil.safety.supervisor import Supervisor
    from dcmp_hil.trip_request import TripRequest
    from dcmp_hil.values import Cycle, Event, Sample

_PHASES = tuple(Phase)
_LIMITS = {
    "RUN_POSITION": "reference",
    "RUN_VELOCITY": "velocity",
    "RUN_ACCELERATION": "acceleration",
    "RUN_WAY": "way",
    "RUN_VOLTAGE": "voltage",
    "RUN_SLEW": "slew",
}


class CoreEnd(NamedTuple):
    """Why a run is over, in numbers.

    Parameters
    ----------
    cause
        Name of the constant in dcmp_cause.h, without DCMP_CAUSE_.
    t
        s, device time of the cycle that found it.
    first, second
        The numbers of its sentence, as dcmp_cause.h has them.
    gain
        (rad/s2)/V, that the polarity check measured.
    cycle
        The last one.
    samples
        Gives the samples that the watching observer saw last.
    """

    cause: str
    t: float
    first: float
    second: float
    gain: float
    cycle: Cycle
    samples: Callable[[], Sequence[Sample]]


class Words:
    """The words of a rig's run.

    Parameters
    ----------
    rig
        What runs.
    supervisor
        Of its stages.
    constants
        Of run.h.
    """

    def __init__(self, rig: Rig, supervisor: Supervisor, constants: Mapping[str, int]) -> None:
        self._rig, self._limiter, self._probe = rig, supervisor.limiter, supervisor.probe
        self._believed = rig.model.ku_rad_s2_V
        self._phase, self._gain = constants["RUN_PHASE"], constants["RUN_PROBE"]
        self._limits = {constants[name]: limit for name, limit in _LIMITS.items()}

    def event(self, t: float, code: int, a: float, b: float) -> Event:
        """Return what happened at `t` (s, device time), by the codes and numbers of run.h."""
        if code == self._phase:
            return phase_event(t, _PHASES[int(a)])
        if code == self._gain:
            return self.motor_gain(a, b).told(t)
        return limit_event(t, self._limits[code], a, b)

    def motor_gain(self, gain: float, deviation: float) -> MotorGain:
        """Return the result of the polarity check, from (rad/s2)/V."""
        return MotorGain(gain, deviation, self._believed)

    def request(self, end: CoreEnd) -> TripRequest:
        """Return the request to trip of a run that is over."""
        _, t, first, second, *_ = end
        if end.cause.startswith("PROBE_"):
            return self._refusal(end)
        limits = self._rig.supervisor
        fastest = limits.velocity_limit_rad_s
        made: dict[str, Callable[[], TripRequest]] = {
            "NUMBERS": lambda: not_finite(end.cycle.sample, end.cycle.estimate),
            "DEMAND": lambda: not_finite_demand(t, first),
            "SPEED": lambda: too_fast(t, first, fastest),
            "WATCH_SPEED": lambda: too_fast(t, first, fastest, WATCHING_OBSERVER),
            "TRAVEL": lambda: too_far(t, first, limits.position_limit_rad),
            "DISTURBANCE": lambda: unknown_forces(
                t, first, limits.disturbance_limit_rad_s2, lambda: self._finding(end.samples())
            ),
            "JUMP": lambda: jumped(t, first),
            "TRACKING": lambda: astray(t, first, second, limits.error_limit),
            "SATURATION": lambda: saturated(t, first, self._limiter.voltage_limit),
            "CHATTER": lambda: self._chattering(end),
        }
        return made[end.cause]()

    def _refusal(self, end: CoreEnd) -> TripRequest:
        """Return the refusal of the polarity check."""
        assert self._probe is not None  # noqa: S101 - the core has one where the stages have
        _, t, first, second, gain, *_ = end
        ways = self._probe.push, first, second
        made: dict[str, Callable[[], TripRequest]] = {
            "PROBE_NUMBERS": lambda: probe.not_finite(t, first, second),
            "PROBE_MOVING": lambda: probe.moves(first, second),
            "PROBE_SLEW": lambda: probe.too_slow(first, ways[0], second),
            "PROBE_POWER": lambda: probe.no_answer(*ways),
            "PROBE_POLARITY": lambda: probe.wrong_way(*ways),
            "PROBE_UNSURE": lambda: probe.unsure(*ways),
            "PROBE_GAIN": lambda: probe.off(*ways, gain / self._believed),
        }
        return made[end.cause]()

    def _chattering(self, end: CoreEnd) -> TripRequest:
        chatter = self._limiter.chatter
        assert chatter is not None  # noqa: S101 - nothing else judges the variation
        count = self._rig.encoder.count
        return chattering(end.t, end.first, chatter.expected, lambda: cause_of(end.samples(), count))

    def _finding(self, samples: Sequence[Sample]) -> Finding:
        diagnosis = Diagnosis(self._rig.observer_context)
        for sample in samples:
            diagnosis.add(sample)
        return diagnosis.finding()
