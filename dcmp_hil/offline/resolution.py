"""The encoder's resolution, told from a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STEP_MIN_RAD = 1e-9  # rad: below it lies the rounding of arithmetic, not an encoder
_CANDIDATES_MAX = 50
_STEP_MAX_COUNTS = 20  # counts: in longer steps a small error of the candidate hides every fraction
_STEPS_MIN = 10  # steps to judge a candidate by
_FITTING_STEPS_SHARE_MIN = 0.95  # of the steps; a few may be glitches
_MISFIT_MAX_COUNTS = 0.15  # counts; 30 % of random steps would pass

_TURN_RAD = 2.0 * np.pi
_COUNTS_PER_REV_MAX = 2.0**24


def estimate_counts_per_rev(position: NDArray[np.float64]) -> float | None:
    """Estimate the counts a revolution from the smallest step of the position.

    A step counts as the encoder's if nearly all the steps of up to twenty counts are whole multiples of it:
    one odd row does not pass for a finer encoder. The estimate is then the median of step / multiple, so that
    the digits that the file was rounded to do not matter.

    Parameters
    ----------
    position
        rad, shape (n,).

    Returns
    -------
    float or None
        Counts a revolution; None where no such step exists (a filtered position, an ideal encoder, an arm
        that hardly moved).
    """
    steps = np.sort(np.abs(np.diff(position)))
    steps = steps[steps > _STEP_MIN_RAD]
    candidate = 0.0
    for _ in range(_CANDIDATES_MAX):
        larger = steps[np.searchsorted(steps, 1.02 * candidate) :]
        if len(larger) < _STEPS_MIN:
            return None
        candidate = float(larger[0])
        short = steps[(steps > 0.5 * candidate) & (steps < (_STEP_MAX_COUNTS + 0.5) * candidate)]
        multiples = np.round(short / candidate)
        fits = np.abs(short / candidate - multiples) < _MISFIT_MAX_COUNTS
        if len(short) >= _STEPS_MIN and np.mean(fits) >= _FITTING_STEPS_SHARE_MIN:
            return float(_TURN_RAD / np.median(short[fits] / multiples[fits]))
    return None


def equivalent_counts_per_rev(position: NDArray[np.float64]) -> float | None:
    """Return the encoder whose quantisation would scatter like a position without visible steps.

    The scatter is taken from the third differences, in which a smooth motion all but vanishes, by their
    median, so that glitches do not matter: white noise of standard deviation s gives sqrt(20) s there, and an
    encoder's step q scatters by q / sqrt(12).

    Parameters
    ----------
    position
        rad, shape (n,), n > 3.

    Returns
    -------
    float or None
        Counts a revolution, at most 2^24; None for a position that does not change.
    """
    scatter = 1.4826 * float(np.median(np.abs(np.diff(position, 3)))) / np.sqrt(20.0)
    if scatter <= 0.0:
        return None
    return float(min(_TURN_RAD / (np.sqrt(12.0) * scatter), _COUNTS_PER_REV_MAX))
