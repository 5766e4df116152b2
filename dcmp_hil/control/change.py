"""A change as the loop takes it: checked, worked out, and small."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dcmp_hil.control.references import ReferenceSource


class Change(NamedTuple):
    """A change that acts from the next cycle on; None means unchanged."""

    words: str  # "controller.kp_1_s2: 4000 -> 5200", for people
    values: Mapping[str, float | str]  # new values by dotted key, for programs
    gains: NamedTuple | None = None
    tuning: object | None = None  # what the observer's `retune` takes
    reference: ReferenceSource | None = None
    variation: float | None = None  # V/s, that is expected of the voltage afterwards
