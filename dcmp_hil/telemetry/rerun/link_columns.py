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
_COUNTERS = (*HOST_COUNTERS, *DEVICE_COUNTERS)
_COLOURS = (
    *((78, 121, 167), (242, 142, 43), (225, 87, 89), (118, 183, 178), (89, 161, 79), (237, 201, 72)),
    *((176, 122, 161), (255, 157, 167), (156, 117, 95), (186, 176, 172), (120, 200, 255), (200, 255, 120)),
)
_WIDTH_POINTS = 1.6


class LinkColumns:
    """Turns counters into lines, each from the first time on that it is not 0."""

    def __init__(self) -> None:
        self._drawn: set[str] = set()

    def of_counters(self, t: float, counters: Mapping[str, int]) -> Iterator[Rows]:
        """Yield the rows for the counters at `t`, s; those that are unknown have none."""
        told = in_order(counters)
        for name, count, colour in zip(_COUNTERS, told, _COLOURS, strict=True):
            if name not in self._drawn and (count > 0 or (name in _ALWAYS_DRAWN and count == 0)):
                self._drawn.add(name)
                yield f"{LINK}/{name}", np.empty(0), _look(name.replace("_", " "), colour)
            if name in self._drawn:
                yield f"{LINK}/{name}", np.array([t]), rr.Scalars.columns(scalars=[count])


def _look(label: str, colour: tuple[int, int, int]) -> rr.SeriesLines:
    return rr.SeriesLines(
        names=[label], colors=[colour], widths=[_WIDTH_POINTS], interpolation_mode="StepAfter"
    )
