"""The reference of a run, tick by tick, as the trajectory of the loop makes it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dcmp_hil.control.trajectory import fade

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.control.references import ReferenceSettings


class Instants(NamedTuple):
    """Instants at which the loop asks for a reference.

    Parameters
    ----------
    period
        s.
    delay
        s, from a sample to the instant at which its command acts.
    now
        Whether it is asked for at each sample's own instant, as where samples are lost.
    middle
        Whether it is asked for between two samples, as for friction that is fed forward.
    """

    period: float
    delay: float
    now: bool
    middle: bool


def reference_rows(
    reference: ReferenceSettings, instants: Instants, ticks: range, row: np.dtype[np.void]
) -> NDArray[np.void]:
    """Return the rows of some ticks, shape (len(ticks),), for a trajectory that begins at 0 s.

    Parameters
    ----------
    reference
        `[reference]`.
    instants
        When it is asked for.
    ticks
        Consecutive numbers.
    row
        `struct lanes_row`.
    """
    rows = np.zeros(len(ticks), row)
    t = np.array(ticks, float) * instants.period
    rows["t"] = t
    soft_start = reference.soft_start_s
    at = reference.source().at
    ahead = t + instants.delay
    rows["x"], rows["v"], rows["a"] = zip(*map(at, ahead.tolist()), strict=True)
    _add_fade(rows, ahead, soft_start, ("fading", "gone", "gone1", "gone2"))
    if instants.now:
        rows["x_now"] = [at(one)[0] for one in t.tolist()]
    elif ticks[0] == 0:
        rows["x_now"][0] = at(0.0)[0]
    _add_fade(rows, t, soft_start, ("fading_now", "gone_now"))
    if instants.middle:
        before = np.maximum(np.array(ticks, float) - 1.0, 0.0) * instants.period
        middle = 0.5 * (t + before)
        rows["x_middle"], rows["v_middle"], _ = zip(*map(at, middle.tolist()), strict=True)
        _add_fade(rows, middle, soft_start, ("fading_middle", "gone_middle", "gone1_middle"))
    return rows


def _add_fade(
    rows: NDArray[np.void], t: NDArray[np.float64], soft_start: float, names: tuple[str, ...]
) -> None:
    """Add the weights of the soft start at instants `t`, s, under a flag and as many names as asked for."""
    flag, *weights = names
    fading = t[t < soft_start].tolist()  # the first ones
    rows[flag][: len(fading)] = 1.0
    if fading:
        columns = zip(*(fade(one, soft_start) for one in fading), strict=True)
        for name, column in zip(weights, columns, strict=False):
            rows[name][: len(fading)] = column
