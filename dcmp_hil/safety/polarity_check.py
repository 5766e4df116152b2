"""The polarity probe: a volt up, a volt down, before engaging: which way does the arm go, and how far."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.safety.diagnosis import moved_by
from dcmp_hil.trip_request import TripRequest
from dcmp_hil.values import Event, EventKind, ProbeData

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from dcmp_hil.control.model import Model
    from dcmp_hil.values import Sample

REST_TIME_S = 0.1  # s at 0 V: is the arm at rest
PUSH_TIME_MAX_S = 0.1  # s each way at most
_PROBE_V, _GENTLE_ACCELERATION_RAD_S2 = 1.0, 15.0  # V; rad/s2
_FRICTION_RATIO_MIN = 2.0  # times the friction that a push must overcome
_REST_TRAVEL_MAX_RAD = 0.02  # rad, that the arm may move while it is watched
_PUSH_TRAVEL_MAX_RAD = 0.03  # rad, at which a push ends early: the whole probe stays within 0.1 rad
_VOLTAGE_RISEN_SHARE = 0.9  # of the voltage
_COASTING_SPEED_RATIO = 3.0  # times the mean speed
_COASTING_TRAVEL_MAX_RAD = 0.032  # rad, where a slow push ends
_RETURN_TRAVEL_MAX_RAD = 0.08  # rad, at which the way back ends early: a slow amplifier turns late
_VOLTAGE_SHARE_MIN = 0.6  # of the voltage asked for, that must be applied: friction alone may need half
_GAIN_RATIO_MAX = 3.0  # measured over believed motor gain, either way, beyond which the probe refuses
_GAIN_RATIO_WARNING = 1.25  # beyond which it warns
_SIGNIFICANCE_DEVIATIONS = 4.0  # standard deviations
_NOISE_COUNTS, _NOISE_MIN_RAD = 0.4, 1e-4  # counts and rad, of a position
_DISTURBANCE_RAD_S2 = 2.0  # rad/s2, what may push besides
_MOTOR_GAIN_RATIO_MAX = 3.0  # times the believed motor gain
_PUSH_TRAVEL_MIN_COUNTS = 2.0  # counts that a push must be expected to move the arm by


class MotorGain(NamedTuple):
    """Motor gain that the polarity check measured."""

    gain: float  # (rad/s2)/V, ku/J
    deviation: float  # (rad/s2)/V, standard deviation
    believed: float  # (rad/s2)/V, model.ku_rad_s2_V

    @property
    def ratio(self) -> float:
        """Measured over believed."""
        return self.gain / self.believed

    def document(self) -> dict[str, float]:
        """Return the measured gain as a document for `run --json`."""
        return {
            "gain_rad_s2_V": self.gain,
            "deviation_rad_s2_V": self.deviation,
            "model_rad_s2_V": self.believed,
            "ratio": self.ratio,
        }

    def told(self, t: float) -> Event:
        """Return the event; a warning if the gain is off by more than 1.25 times and its uncertainty."""
        doubt = self.deviation / self.believed
        off = self.ratio - doubt > _GAIN_RATIO_WARNING or self.ratio + doubt < 1.0 / _GAIN_RATIO_WARNING
        said = (
            f"probe: motor gain {self.gain:.3g} +- {self.deviation:.2g} (rad/s2)/V, "
            f"{self.ratio:.2f} times [model]'s {self.believed:g}"
        )
        data = ProbeData(self.gain, self.deviation, self.ratio)
        if not off:
            return Event(t, "INFO", EventKind.PROBE, said, data)
        remedy = "Look at model.ku_rad_s2_V, motor supply, gear and encoder.counts_per_rev."
        return Event(t, "WARN", EventKind.PROBE, f"{said}. {remedy}", data)


class PolarityCheck:
    """Moves the arm by a few hundredths of a radian and compares with what `[model]` says.

    The second push lasts as long as the first. Until the arm turns round, friction, gravity and a constant
    push add up to a constant acceleration, and so the motor's gain is what the two directions of the voltage
    tell apart: least squares over every sample, which is finer than a count.

    Parameters
    ----------
    ku
        (rad/s2)/V, the believed motor gain ku/J.
    voltage
        V, of a push.
    gravity
        rad/s2, of the pendulum, as believed.
    count
        rad, one count of the encoder; 0 for an ideal one.
    notify
        Told of the motor's gain.

    Attributes
    ----------
    found
        The motor's gain; None before the probe is over.
    over
        Whether it is over, and all is well.
    voltage
        V, for the period of the last sample.
    """

    def __init__(
        self,
        ku: float,
        voltage: float,
        count: float,
        notify: Callable[[Event], None] | None = None,
        *,
        gravity: float = 0.0,
    ) -> None:
        self._ku, self._push, self._count, self._gravity = ku, voltage, count, gravity
        self._began = math.nan  # s, of the present stage
        self._x0 = math.nan  # rad, where the arm was as the stage of watching, and then the pushes, began
        self._seen: list[tuple[float, float, float]] = []  # s and rad since the pushes began, V applied
        self._notify = notify
        self.found: MotorGain | None = None
        self._length = math.nan  # s, of the first push
        self._rise = 0.0  # s, that the voltage applied takes to get there, and takes to get back
        self._stage = self._watch
        self.over = False
        self.voltage = 0.0

    @property
    def telling(self) -> bool:
        """Whether the encoder is fine enough for the probe to say anything."""
        return (
            0.5 * self._ku * self._push * PUSH_TIME_MAX_S * PUSH_TIME_MAX_S
            > _PUSH_TRAVEL_MIN_COUNTS * self._count
        )

    def check(self, sample: Sample) -> TripRequest | None:
        """Judge a sample; return a TripRequest if the rig contradicts its file.

        Reasons are ``moving``, ``power``, ``slew``, ``polarity``, ``gain`` and ``not_finite``.
        """
        if not math.isfinite(sample.t + sample.position + sample.voltage):
            return TripRequest(
                "not_finite",
                f"Not every number is finite while the arm is probed: position {sample.position}, voltage "
                f"{sample.voltage}, t = {sample.t:.3f} s.",
                "Look at the encoder, and at the class that is the backend.",
            )
        if math.isnan(self._began):
            self._began, self._x0 = sample.t, sample.position
        return self._stage(sample.t - self._began, sample)

    def _watch(self, since: float, sample: Sample) -> TripRequest | None:
        moved = sample.position - self._x0
        if not -_REST_TRAVEL_MAX_RAD <= moved <= _REST_TRAVEL_MAX_RAD:
            return TripRequest(
                "moving",
                f"The arm moves by itself: {moved:+.3f} rad in {since:.3f} s at 0 V.",
                'Bring it to rest, hanging, and start again; supervisor.probe = "off" starts without it.',
            )
        if since >= REST_TIME_S:
            self._began, self._x0 = sample.t, sample.position
            self._seen = [(0.0, sample.position, 0.0)]
            self._stage, self.voltage = self._push_up, self._push
        return None

    def _push_up(self, since: float, sample: Sample) -> TripRequest | None:
        self._seen.append((since, sample.position, sample.voltage))
        moved = abs(sample.position - self._x0)
        if not abs(sample.voltage) >= _VOLTAGE_RISEN_SHARE * self._push:
            self._rise = since
        coasting = _COASTING_SPEED_RATIO * moved / since * self._rise if since > 0.0 else 0.0
        if not (
            since < PUSH_TIME_MAX_S
            and moved < _PUSH_TRAVEL_MAX_RAD
            and moved + coasting < _COASTING_TRAVEL_MAX_RAD
        ):
            self._length, self._began = since, sample.t
            self._stage, self.voltage = self._push_down, -self._push
        return None

    def _push_down(self, since: float, sample: Sample) -> TripRequest | None:
        self._seen.append((self._length + since, sample.position, sample.voltage))
        if since < self._length and abs(sample.position - self._x0) < _RETURN_TRAVEL_MAX_RAD:
            return None
        stop = self._judge(np.array(self._seen).T)
        self.over = stop is None
        if self.over and self._notify and self.found:
            self._notify(self.found.told(sample.t))
        return stop

    @np.errstate(all="ignore")  # what overflows is far from any gain, and is refused
    def _judge(self, seen: NDArray[np.float64]) -> TripRequest | None:
        """Compare the measured motor gain with the believed one; an encoder's step is given the benefit."""
        moved = seen[1] - self._x0
        up, farthest = (
            moved[min(np.searchsorted(seen[0], self._length), len(moved) - 1)],
            float(np.abs(moved).max()),
        )
        gain, deviation = self._gain(seen[0], moved, seen[2])
        self.found = MotorGain(gain, deviation, self._ku)
        unsure = _SIGNIFICANCE_DEVIATIONS * deviation
        volts, down = f"{self._push:g} V", moved[-1] - up
        said = f"+{volts} moved the arm by {up:+.4f} rad, -{volts} by {down:+.4f} rad"
        unclear = not gain - unsure > 0.0 and gain + unsure > 0.0
        reached = float(np.abs(seen[2]).max())
        if (not farthest > self._count or unclear) and not reached >= _VOLTAGE_SHARE_MIN * self._push:
            return self._too_slow(reached)
        if not farthest > self._count:
            return TripRequest(
                "power",
                f"The arm does not answer: {said}.",
                "Look at motor supply, e-stop and ENABLE, at the coupling, and at the encoder's cable.",
            )
        if not gain + unsure > 0.0:
            return TripRequest(
                "polarity",
                f"The arm goes the wrong way: {said}.",
                "Change amplifier.sign, or encoder.sign if the count falls when you lift the arm by hand.",
            )
        if not gain - unsure > 0.0:
            return TripRequest(
                "power",
                f"The arm hardly answers, too little to tell which way: {said}.",
                'Look what holds it, and at the motor supply; supervisor.probe = "off" starts without.',
            )
        if not (gain + unsure > self._ku / _GAIN_RATIO_MAX and gain - unsure < self._ku * _GAIN_RATIO_MAX):
            return TripRequest(
                "gain",
                f"The arm answers {gain / self._ku:.2g} times as strongly as [model] says: {said}.",
                "Look at encoder.counts_per_rev (after quadrature), at the gear, and at model.ku_rad_s2_V.",
            )
        return None

    def _too_slow(self, reached: float) -> TripRequest:
        """Return the TripRequest for an amplifier whose output was too low to move the arm."""
        return TripRequest(
            "slew",
            f"The amplifier put out {reached:.2g} V of the {self._push:g} V asked for in "
            f"{self._length:.2g} s, too little to move the arm.",
            "Look at the slew limit of the device and at amplifier.slew_V_s: 20 V/s and more would do.",
        )

    def _gain(
        self, t: NDArray[np.float64], moved: NDArray[np.float64], applied: NDArray[np.float64]
    ) -> tuple[float, float]:
        """Fit the motor's gain and a constant push to the way out: until it turns, friction is constant."""
        out = int(np.flatnonzero(np.abs(moved) == np.abs(moved).max())[-1]) + 1
        t, moved, applied = t[:out], moved[:out], applied[:out]
        columns = np.column_stack([np.ones_like(t), 0.5 * t * t, moved_by(t, applied)])
        noise = math.hypot(_NOISE_COUNTS * self._count, _NOISE_MIN_RAD)
        usual = np.array(
            [max(self._count, _NOISE_MIN_RAD), _DISTURBANCE_RAD_S2, _MOTOR_GAIN_RATIO_MAX * self._ku]
        )
        covariance = np.linalg.inv(columns.T @ columns / noise**2 + np.diag(usual**-2))
        moved = moved + moved_by(t, self._gravity * np.sin(moved))  # as if it did not fall
        gain = (covariance @ columns.T @ moved)[2] / noise**2
        return float(gain), float(np.sqrt(covariance[2, 2]))


def probe_for(
    model: Model, voltage_limit: float, count: float, notify: Callable[[Event], None] | None = None
) -> PolarityCheck | None:
    """Make the probe of a rig; None where its encoder is too coarse to tell.

    Parameters
    ----------
    model
        What the host believes of the pendulum.
    voltage_limit
        V, of the amplifier.
    count
        rad, one count of the encoder; 0 for an ideal one.
    notify
        Told of the motor's gain.
    """
    gentle = min(_PROBE_V, _GENTLE_ACCELERATION_RAD_S2 / model.ku)
    voltage = min(voltage_limit, max(gentle, _FRICTION_RATIO_MIN * model.f1 / model.ku))
    probe = PolarityCheck(model.ku, voltage, count, notify, gravity=model.gravity)
    return probe if probe.telling else None
