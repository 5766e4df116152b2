"""Friction as an observer found it, and how often its model did not hold, block by block."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block

_FOUND, _DISTRUST = "friction_found_rad_s2", "distrust"
_LET_GO_ABOVE, _BACK_BELOW = 10.0, 2.0
"""Distrust above which an observer has let go of its model, and below which it is back."""
_OFFER_DEVIATIONS, _OFFER_SHARE, _OFFER_DIGITS = 3.0, 0.05, 3
"""Difference beyond which the friction found is offered for the model: deviations, share of the model."""
_OFFER_HELD_SHARE = 0.5  # of the window, in which the model held at the end


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

    @property
    def offered(self) -> float | None:
        """Friction that the model should have; None where what it has will do, or the model did not hold."""
        found, deviation = self.found_rad_s2, self.deviation_rad_s2
        if found is None or deviation is None or self.held_share < _OFFER_HELD_SHARE:
            return None
        least = max(_OFFER_DEVIATIONS * deviation, _OFFER_SHARE * self.model_rad_s2)
        far = abs(found - self.model_rad_s2) > least  # False where the model is unknown
        return float(f"{found:.{_OFFER_DIGITS}g}") if far else None


class FrictionStatistics:
    """Makes the findings of a run, in bounded memory; they are None where no observer diagnoses friction."""

    def __init__(self) -> None:
        self._model = math.nan
        self._known = self._away = False
        self._cycles = self._times = 0
        self._largest, self._largest_t = 0.0, math.nan
        self._restart()

    def add(self, block: Block, window: slice) -> None:
        """Add the cycles of a block that are in the window, at least one."""
        if not {_FOUND, _DISTRUST} <= set(block.further):
            return
        self._known, self._model = True, block.model.f1
        t, distrust, found = (block[name][window] for name in ("t", _DISTRUST, _FOUND))
        self._cycles += len(t)
        start = 0  # of the cycles in which it held
        if self._away or (distrust > _LET_GO_ABOVE).any():
            for k, (now, m) in enumerate(zip(t.tolist(), distrust.tolist(), strict=True)):
                away = self._away
                self._follow(now, m)
                if self._away and not away:
                    self._add(found[start:k], distrust[start:k])
                elif away and not self._away:
                    start = k
                    self._restart()
        if not self._away:
            self._add(found[start:], distrust[start:])

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
        )

    def _restart(self) -> None:
        """Begin the mean anew."""
        self._held = self._calm = 0  # cycles; those of them with a low distrust
        self._first, self._sum, self._squares = math.nan, 0.0, 0.0  # of differences from the first value

    def _add(self, found: NDArray[np.float64], distrust: NDArray[np.float64]) -> None:
        """Add cycles in which the model held."""
        self._held += len(found)
        calm = found[(distrust < _BACK_BELOW) & np.isfinite(found)]
        if not len(calm):
            return
        if not self._calm:
            self._first = float(calm[0])
        off = calm - self._first
        self._calm += len(off)
        self._sum += float(off.sum())
        self._squares += float(off @ off)

    def _follow(self, t: float, distrust: float) -> None:
        """Take the distrust of one cycle."""
        if not self._away and distrust > _LET_GO_ABOVE:
            self._away = True
            self._times += 1
        elif self._away and distrust < _BACK_BELOW:
            self._away = False
        if self._away and distrust > self._largest:
            self._largest, self._largest_t = distrust, t
