"""Why the arm does not answer the voltage as the model says, told from a tenth of a second."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from numpy.typing import NDArray

    from dcmp_hil.control.observers import ObserverContext
    from dcmp_hil.values import Sample

    Vector = NDArray[np.float64]

_WINDOW_S = 100e-3  # s
_SAMPLES_MIN, _SAMPLES_MAX = 12, 64  # samples that say anything; that are looked at
_ONSET_COUNT = 24  # instants in the window at which the fault may have begun
_NOISE_COUNTS, _NOISE_MIN_RAD = 0.4, 2e-4  # counts and rad: of a position, quantised and modelled
_START_DEVIATIONS = (10.0, 10.0, 5.0)  # rad, rad/s, rad/s2: what position, velocity and friction may be
_GAIN_DEVIATION = 0.25  # of a motor's gain
_DEAD_MOTOR_GAIN_DEVIATION = 0.15  # of a dead motor's gain
_PUSH_DEVIATION_RAD_S2 = 100.0  # of a push


class Finding(NamedTuple):
    """A cause, by name and in words."""

    reason: str
    sentence: str
    remedy: str


_STUCK = Finding(
    "stuck",
    "The encoder shows the same position all the time",
    "Look at the encoder's cable, supply and coupling.",
)
_POWER = Finding(
    "power",
    "The arm moves as if the motor had no current",
    "Look at motor supply, e-stop, ENABLE and fuse.",
)
_POLARITY = Finding(
    "polarity",
    "The motor pushes the arm the wrong way",
    "Look at the polarity of motor and encoder: amplifier.sign, encoder.sign.",
)
_OTHER_CAUSE = Finding(
    "disturbance",
    "Something pushes the arm that the model does not know",
    "Look for an obstacle, at the load and [model], and that the voltage fed back is the one really applied.",
)


class Diagnosis:
    """Remembers what was measured, and says on demand what that looks like.

    Each cause is a model of the last 100 ms: the believed pendulum, until some instant, and from there on a
    motor that is dead or reversed, an encoder that stands still or counts the other way, or a push of unknown
    strength. Position, velocity and friction at the start, the motor's gain and the push are Gaussian;
    so the probability of the measured positions is a closed form, and the cause under which they are the most
    probable, over all instants, is the finding. It takes
    milliseconds.

    Parameters
    ----------
    setting
        What the host believes of the pendulum, and its encoder.
    """

    def __init__(self, setting: ObserverContext) -> None:
        self._model, counts = setting.model, setting.counts_per_rev
        self._noise = math.hypot(_NOISE_COUNTS * (math.tau / counts if counts else 0.0), _NOISE_MIN_RAD)
        self._seen: deque[Sample] = deque(maxlen=window_samples(setting.period))
        self.add = self._seen.append
        """Remember a sample; called every cycle, so there is no function around it."""

    @property
    def samples(self) -> Collection[Sample]:
        """The last 100 ms."""
        return self._seen

    def finding(self) -> Finding:
        """Return the likely cause, judged by the last samples."""
        if len(self._seen) < _SAMPLES_MIN:
            return _OTHER_CAUSE
        t, position, voltage, _ = np.array(self._seen, float).T
        if not (np.isfinite(t + position + voltage).all() and (np.diff(t) > 0.0).all()):
            return _OTHER_CAUSE
        return max(self._causes(t - t[0], position, voltage), key=lambda found: found[1])[0]

    def _causes(self, t: Vector, position: Vector, voltage: Vector) -> Iterator[tuple[Finding, float]]:
        """Yield each cause with the logarithm of its probability, up to a constant."""
        shown = np.unique(np.linspace(0, len(t) - 1, _SAMPLES_MAX).astype(int))
        judge = _Judge(t, shown, self._noise)
        driven = self._model.ku * voltage
        fallen = -self._model.gravity * np.sin(position)
        expected = position - moved_by(t, driven + fallen)
        found: dict[str, list[float]] = {"other": [], "power": [], "motor": [], "encoder": [], "stuck": []}
        for onset in np.unique(np.linspace(0, len(t) - _SAMPLES_MIN // 2, _ONSET_COUNT).astype(int)):
            after = np.arange(len(t)) > onset
            late, early = moved_by(t, driven * after), moved_by(t, driven * ~after)
            push = moved_by(t, after.astype(float))
            mirrored = np.where(after, 2.0 * position[onset] - position, position)
            turned = mirrored - moved_by(t, driven - self._model.gravity * np.sin(mirrored))
            found["other"].append(
                judge.weigh(expected, (early + late, _GAIN_DEVIATION), (push, _PUSH_DEVIATION_RAD_S2))
            )
            found["power"].append(
                judge.weigh(expected + late, (early, _GAIN_DEVIATION), (late, _DEAD_MOTOR_GAIN_DEVIATION))
            )
            found["motor"].append(judge.weigh(expected + 2.0 * late, (early - late, _GAIN_DEVIATION)))
            found["encoder"].append(judge.weigh(turned, (early + late, _GAIN_DEVIATION)))
            found["stuck"].append(judge.weigh_stuck(expected, position, int(onset)))
        reasons = {"power": _POWER, "motor": _POLARITY, "encoder": _POLARITY, "stuck": _STUCK}
        for name, logs in found.items():
            yield reasons.get(name, _OTHER_CAUSE), float(np.logaddexp.reduce(logs))


def window_samples(period: float) -> int:
    """Return how many samples the last 100 ms have; `period` in s."""
    return max(_SAMPLES_MIN, round(_WINDOW_S / period))


def moved_by(t: Vector, acceleration: Vector) -> Vector:
    """Integrate accelerations twice, each held over the period that ends at its instant."""
    step = np.diff(t, prepend=t[0])
    velocity = np.cumsum(step * acceleration)
    moved: Vector = np.cumsum(step * (velocity - 0.5 * step * acceleration))
    return moved


class _Judge:
    """Gaussian probabilities of what is left of the positions when a cause's motion is taken out.

    Parameters
    ----------
    t
        s, of every sample, from 0.
    shown
        Which samples are looked at.
    noise
        rad, of each.
    """

    def __init__(self, t: Vector, shown: NDArray[np.intp], noise: float) -> None:
        self._shown, self._noise = shown, noise
        start = np.column_stack([np.ones_like(t), t, 0.5 * t * t])[shown] * _START_DEVIATIONS
        covariance = start @ start.T + noise * noise * np.eye(len(shown))
        self._root = np.linalg.cholesky(covariance)
        self._white = np.linalg.inv(self._root)  # of the first n rows, for the first n samples as well
        self._volume = np.cumsum(np.log(np.diag(self._root)))

    def weigh(self, rest: Vector, *unknown: tuple[Vector, float]) -> float:
        """Return the log probability of the rest, with unknown multiples of columns in it, each N(0, s^2)."""
        white = self._white @ rest[self._shown]
        columns = self._white @ np.column_stack([s * column[self._shown] for column, s in unknown])
        inner = np.eye(len(unknown)) + columns.T @ columns
        along = columns.T @ white
        square = white @ white - along @ np.linalg.solve(inner, along)
        return float(-0.5 * (square + math.log(np.linalg.det(inner))) - self._volume[-1])

    def weigh_stuck(self, rest: Vector, position: Vector, onset: int) -> float:
        """Return the log probability of a motion that ends at a sample, and that sample shown ever after."""
        moving = int(np.searchsorted(self._shown, onset, side="right"))
        white = self._white[:moving, :moving] @ rest[self._shown[:moving]]
        if np.ptp(position[onset:]) != 0.0:
            return -math.inf
        volume = self._volume[moving - 1] + (len(self._shown) - moving) * math.log(self._noise)
        return float(-0.5 * (white @ white) - volume)
