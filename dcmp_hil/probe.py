"""The polarity probe: a volt up, a volt down, before engaging: which way does the arm go, and how far."""

from __future__ import annotations

import math

from dcmp_hil.errors import TripError

WATCH = 0.1  # s at 0 V: is the arm at rest
PUSH = 0.1  # s each way at most
_REST = 0.02  # rad, that the arm may move while it is watched
_FAR = 0.03  # rad, at which a push ends early: the whole probe stays within 0.1 rad
_SPREAD = 3.0  # measured over believed motor gain, either way
_TELLING = 2.0  # counts that a push must be expected to move the arm by


class Probe:
    """Moves the arm by a few hundredths of a radian and compares with what `[model]` says.

    The second push lasts as long as the first, so that friction, gravity and a constant disturbance drop out:
    with displacements d1 and d2 in time T each, x'' differs by 2 (3 d1 - d2) / T^2 between them, which is
    2 ku/J V.

    Parameters
    ----------
    ku
        (rad/s2)/V, the believed motor gain ku/J.
    voltage
        V, of a push.
    count
        rad, one count of the encoder; 0 for an ideal one.
    """

    def __init__(self, ku: float, voltage: float, count: float) -> None:
        self._ku, self._voltage, self._count = ku, voltage, count
        self._began = math.nan  # s, of the present stage
        self._x0 = self._x1 = math.nan  # rad, where the arm was as the first and the second push began
        self._length = math.nan  # s, of the first push
        self._stage = self._watch

    @property
    def telling(self) -> bool:
        """Whether the encoder is fine enough for the probe to say anything."""
        return 0.5 * self._ku * self._voltage * PUSH * PUSH > _TELLING * self._count

    def voltage_at(self, t: float, position: float) -> float | None:
        """Return the voltage for this period, V; None when the probe is over and all is well.

        Raises
        ------
        TripError
            ``moving``, ``power``, ``polarity`` or ``gain``: the rig is not what the file says.
        """
        if math.isnan(self._began):
            self._began, self._x0 = t, position
        return self._stage(t - self._began, t, position)

    def _watch(self, since: float, t: float, position: float) -> float | None:
        if not -_REST <= position - self._x0 <= _REST:
            raise TripError(
                "moving",
                f"The arm moves by itself: {position - self._x0:+.3f} rad in {since:.3f} s at 0 V.",
                'Bring it to rest, hanging, and start again; supervisor.probe = "off" starts without it.',
            )
        if since < WATCH:
            return 0.0
        return self._begin(self._push_up, t, position, self._voltage)

    def _push_up(self, since: float, t: float, position: float) -> float | None:
        if since < PUSH and abs(position - self._x0) < _FAR:
            return self._voltage
        self._length, self._x1 = since, position
        self._began, self._stage = t, self._push_down
        return -self._voltage

    def _push_down(self, since: float, t: float, position: float) -> float | None:  # noqa: ARG002
        if since < self._length:
            return -self._voltage
        self._judge(self._x1 - self._x0, position - self._x1)
        return None

    def _begin(self, stage: object, t: float, position: float, voltage: float) -> float:
        self._began, self._x0 = t, position
        self._stage = stage  # type: ignore[assignment]
        return voltage

    def _judge(self, up: float, down: float) -> None:
        """Compare the measured motor gain with the believed one; an encoder's step is given the benefit."""
        scale = 1.0 / (self._length * self._length * self._voltage)
        gain, unsure = (3.0 * up - down) * scale, 4.0 * self._count * scale
        seen = f"+{self._voltage:g} V moved the arm by {up:+.4f} rad, -{self._voltage:g} V by {down:+.4f} rad"
        if not max(abs(up), abs(down)) > self._count:
            raise TripError(
                "power",
                f"The arm does not answer: {seen}.",
                "Look at motor supply, e-stop and ENABLE, at the coupling, and at the encoder's cable.",
            )
        if not gain + unsure > 0.0:
            raise TripError(
                "polarity",
                f"The arm goes the wrong way: {seen}.",
                "Change amplifier.sign, or encoder.sign if the count falls when you lift the arm by hand.",
            )
        if not (gain + unsure > self._ku / _SPREAD and gain - unsure < self._ku * _SPREAD):
            raise TripError(
                "gain",
                f"The arm answers {gain / self._ku:.2g} times as strongly as [model] says: {seen}.",
                "Look at encoder.counts_per_rev (after quadrature), at the gear, and at model.ku_rad_s2_V.",
            )
