"""The polarity probe: a volt up, a volt down, before engaging: which way does the arm go, and how far."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.safety import polarity_refusals
from dcmp_hil.safety.motor_gain_fit import MotorGainFit
from dcmp_hil.values import Event, EventKind, ProbeData

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.control.model import Model
    from dcmp_hil.trip_request import TripRequest
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
        self._ku, self._push, self._count = ku, voltage, count
        self._began = math.nan  # s, of the present stage
        self._x0 = math.nan  # rad, where the arm was as the stage of watching, and then the pushes, began
        self._fit = MotorGainFit(ku, gravity, count)
        self._up = self._reached = 0.0  # rad, the way of the first push; V, either way, applied at most
        self._notify = notify
        self.found: MotorGain | None = None
        self._length = math.nan  # s, of the first push
        self._rise = 0.0  # s, that the voltage applied takes to get there, and takes to get back
        self._stage = self._watch
        self.over = False
        self.voltage = 0.0

    @property
    def push(self) -> float:
        """Voltage of a push, V."""
        return self._push

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
        t, position, voltage, _ = sample
        if not math.isfinite(t + position + voltage):
            return polarity_refusals.not_finite(t, position, voltage)
        if math.isnan(self._began):
            self._began, self._x0 = sample.t, sample.position
        return self._stage(sample.t - self._began, sample)

    def _watch(self, since: float, sample: Sample) -> TripRequest | None:
        moved = sample.position - self._x0
        if not -_REST_TRAVEL_MAX_RAD <= moved <= _REST_TRAVEL_MAX_RAD:
            return polarity_refusals.moves(moved, since)
        if since >= REST_TIME_S:
            self._began, self._x0 = sample.t, sample.position
            self._fit.add(0.0, 0.0, 0.0)
            self._stage, self.voltage = self._push_up, self._push
        return None

    def _push_up(self, since: float, sample: Sample) -> TripRequest | None:
        way = self._see(since, sample)
        moved = abs(way)
        if not abs(sample.voltage) >= _VOLTAGE_RISEN_SHARE * self._push:
            self._rise = since
        coasting = _COASTING_SPEED_RATIO * moved / since * self._rise if since > 0.0 else 0.0
        if not (
            since < PUSH_TIME_MAX_S
            and moved < _PUSH_TRAVEL_MAX_RAD
            and moved + coasting < _COASTING_TRAVEL_MAX_RAD
        ):
            self._up, self._length, self._began = way, since, sample.t
            self._stage, self.voltage = self._push_down, -self._push
        return None

    def _push_down(self, since: float, sample: Sample) -> TripRequest | None:
        moved = self._see(self._length + since, sample)
        if since < self._length and abs(moved) < _RETURN_TRAVEL_MAX_RAD:
            return None
        stop = self._judge(moved - self._up)
        self.over = stop is None
        if self.over and self._notify and self.found:
            self._notify(self.found.told(sample.t))
        return stop

    def _see(self, since: float, sample: Sample) -> float:
        """Take in a sample of a push, `since` the pushes began (s); return the way from there, rad."""
        moved = sample.position - self._x0
        self._fit.add(since, moved, sample.voltage)
        self._reached = max(self._reached, abs(sample.voltage))
        return moved

    def _judge(self, down: float) -> TripRequest | None:
        """Compare the measured motor gain with the believed one; an encoder's step is given the benefit."""
        gain, deviation = self._fit.gain()
        self.found = MotorGain(gain, deviation, self._ku)
        unsure = _SIGNIFICANCE_DEVIATIONS * deviation
        least, most = gain - unsure, gain + unsure
        still, unclear = not self._fit.farthest > self._count, not least > 0.0 and most > 0.0
        ways = self._push, self._up, down
        if (still or unclear) and not self._reached >= _VOLTAGE_SHARE_MIN * self._push:
            return polarity_refusals.too_slow(self._reached, self._push, self._length)
        if still:
            return polarity_refusals.no_answer(*ways)
        if not most > 0.0:
            return polarity_refusals.wrong_way(*ways)
        if unclear:
            return polarity_refusals.unsure(*ways)
        if not (most > self._ku / _GAIN_RATIO_MAX and least < self._ku * _GAIN_RATIO_MAX):
            return polarity_refusals.off(*ways, self.found.ratio)
        return None


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
