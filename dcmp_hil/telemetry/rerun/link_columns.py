"""Counters of the link as lines with names: only what has counted something has one, and what is lost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from dcmp_hil.telemetry.link_events import DEVICE_COUNTERS, HOST_COUNTERS, in_order

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from dcmp_hil.telemetry.rerun.plot_columns import Rows

LINK = "link"
_ALWAYS_DRAWN = {"lost"}  # so that a link without a fault has a line at 0
_LABELS = {
    **{name: name for name in HOST_COUNTERS},
    **{name: f"device: {name}".replace("_", " ") for name in DEVICE_COUNTERS},
}
_WIDTH_POINTS = 1.6


class LinkColumns:
    """Turns counters into lines, each from the first time on that it is not 0."""

    def __init__(self) -> None:
        self._drawn: set[str] = set()

    def of_counters(self, t: float, counters: Mapping[str, int]) -> Iterator[Rows]:
        """Yield the rows for the counters at `t`, s; those that are unknown have none."""
        for (name, label), count in zip(_LABELS.items(), in_order(counters), strict=True):
            if name not in self._drawn and (count > 0 or (name in _ALWAYS_DRAWN and count == 0)):
                self._drawn.add(name)
                look = rr.SeriesLines(names=[label], widths=[_WIDTH_POINTS], interpolation_mode="StepAfter")
                yield f"{LINK}/{name}", np.empty(0), look
            if name in self._drawn:
                yield f"{LINK}/{name}", np.array([t]), rr.Scalars.columns(scalars=[count])
