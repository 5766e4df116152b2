"""Friction as an observer found it, and how often its model did not hold, block by block."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block

DISTRUST = "distrust"
"""Column of how far an observer trusts its own model: 1 wholly, and more the less."""
_FOUND, _UNCERTAINTY = "friction_found_rad_s2", "friction_deviation_rad_s2"
_LET_GO_ABOVE, _BACK_BELOW = 10.0, 2.0
"""Distrust above which an observer has let go of its model, and below which it is back."""
_OFFER_DEVIATIONS, _OFFER_SHARE, _OFFER_DIGITS = 3.0, 0.05, 3
"""Difference beyond which the friction found is offered for the model: deviations, share of the model."""
_OFFER_HELD_SHARE = 0.5  # of the window, in which the model held at the end
_OFFER_HELD_S = 4.0  # s; in a shorter time what is found is that of the start, or of one reversal


@dataclass(frozen=True, slots=True)
class FrictionFindings:
    """Friction as the observer that closes the loop found it, over the window of the figures."""

    found_rad_s2: float | None
    """Coulomb friction: its mean over the cycles with a distrust below 2, since the observer last came back
    to its model; None without one."""
    deviation_rad_s2: float | None
    """Standard deviation over these cycles: large while the friction found still changes."""
    model_rad_s2: float
    """The rig's model.f1_rad_s2."""
    let_go: int
    """Times that the observer let go of its model: distrust above 10, until it is below 2."""
    largest_distrust: float | None
    largest_distrust_t_s: float | None
    """The largest distrust of those times, and its device time; None without one."""

    held_share: float
    """Share of the window in which the model held since then, or since its beginning."""
    held_s: float
    """Time of that share, s."""
    uncertainty_rad_s2: float | None
    """Standard deviation by the observer itself in the last of these cycles; None where it has none."""

    @property
    def offered(self) -> float | None:
        """Friction that the model should have; None where what it has will do, or the model did not hold."""
        found, deviation = self.found_rad_s2, self.deviation_rad_s2
        held = self.held_share >= _OFFER_HELD_SHARE and self.held_s >= _OFFER_HELD_S
        if found is None or deviation is None or not held:
            return None
        least = max(_OFFER_DEVIATIONS * deviation, _OFFER_SHARE * self.model_rad_s2)
        least = max(least, self.uncertainty_rad_s2 or 0.0)
        far = abs(found - self.model_rad_s2) > least  # False where the model is unknown
        return float(f"{found:.{_OFFER_DIGITS}g}") if far else None


class ModelHold:
    """Follows whether an observer holds to its model, cycle by cycle.

    Attributes
    ----------
    away
        Whether it has let go of it.
    """

    def __init__(self) -> None:
        self.away = False

    def of(self, distrust: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return where it has let go, shape (n,), for the distrust of the next cycles, shape (n,)."""
        if not self.away and not (distrust > _LET_GO_ABOVE).any():
            return np.zeros(len(distrust), dtype=bool)
        away = np.empty(len(distrust), dtype=bool)
        for k, m in enumerate(distrust.tolist()):
            self.away = m >= _BACK_BELOW if self.away else m > _LET_GO_ABOVE
            away[k] = self.away
        return away


class FrictionStatistics:
    """Makes the findings of a run, in bounded memory; they are None where no observer diagnoses friction."""

    def __init__(self) -> None:
        self._model = math.nan
        self._known, self._hold = False, ModelHold()
        self._cycles = self._times = 0
        self._largest, self._largest_t = 0.0, math.nan
        self._restart()

    def add(self, block: Block, window: slice) -> None:
        """Add the cycles of a block that are in the window, at least one."""
        if not {_FOUND, DISTRUST} <= set(block.further):
            return
        self._known, self._model = True, block.model.f1
        t, distrust, found = (block[name][window] for name in ("t", DISTRUST, _FOUND))
        deviation = block[_UNCERTAINTY][window] if _UNCERTAINTY in block.further else None
        self._cycles += len(t)
        was = self._hold.away
        away = self._hold.of(distrust)
        turns = np.flatnonzero(np.diff(away, prepend=was)).tolist()
        for first, end in pairwise((0, *turns, len(t))):
            if first < end and away[first]:
                self._times += first in turns
                self._take_largest(t[first:end], distrust[first:end])
            elif first < end:
                if first in turns:
                    self._restart()
                self._add(t[first:end], found[first:end], distrust[first:end])
                if deviation is not None:
                    self._uncertainty = float(deviation[end - 1])

    def findings(self) -> FrictionFindings | None:
        """Return the findings of the blocks so far."""
        if not self._known:
            return None
        found = deviation = None
        if self._calm:
            off = self._sum / self._calm
            found = self._first + off
            deviation = math.sqrt(max(0.0, self._squares / self._calm - off * off))
        return FrictionFindings(
            found_rad_s2=found,
            deviation_rad_s2=deviation,
            model_rad_s2=self._model,
            let_go=self._times,
            largest_distrust=self._largest if self._times else None,
            largest_distrust_t_s=self._largest_t if self._times else None,
            held_share=self._held / self._cycles,
            held_s=self._until - self._since if self._held else 0.0,
            uncertainty_rad_s2=self._uncertainty if math.isfinite(self._uncertainty) else None,
        )

    def _restart(self) -> None:
        """Begin the mean anew."""
        self._held = self._calm = 0  # cycles; those of them with a low distrust
        self._first, self._sum, self._squares = math.nan, 0.0, 0.0  # of differences from the first value
        self._since = self._until = self._uncertainty = math.nan

    def _add(self, t: NDArray[np.float64], found: NDArray[np.float64], distrust: NDArray[np.float64]) -> None:
        """Add cycles in which the model held; one whose distrust is no number says nothing of that."""
        told = np.flatnonzero(np.isfinite(distrust))
        if len(told):
            self._since = self._since if self._held else float(t[told[0]])
            self._until = float(t[told[-1]])
            self._held += len(told)
        calm = found[(distrust < _BACK_BELOW) & np.isfinite(found)]
        if not len(calm):
            return
        if not self._calm:
            self._first = float(calm[0])
        off = calm - self._first
        self._calm += len(off)
        self._sum += float(off.sum())
        self._squares += float(off @ off)

    def _take_largest(self, t: NDArray[np.float64], distrust: NDArray[np.float64]) -> None:
        """Take cycles in which the observer had let go."""
        k = int(np.argmax(distrust))
        if distrust[k] > self._largest:
            self._largest, self._largest_t = float(distrust[k]), float(t[k])
