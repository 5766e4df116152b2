"""Causes of an end: words of the host, numbers of the core, and the numbers in the sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

CAUSES: Mapping[str, tuple[int, ...]] = {
    "not_finite": (1, 2, 8),
    "speed": (3, 5),
    "travel": (4,),
    "disturbance": (6,),
    "jump": (7,),
    "moving": (9,),
    "slew": (10,),
    "power": (11, 13),
    "polarity": (12,),
    "gain": (14,),
    "tracking": (15,),
    "saturation": (16,),
    "chatter": (17,),
}
"""Words of `TripRequest` and numbers of enum dcmp_cause."""
FORMATS = {
    2: " {} V",
    7: " {:+.3f} rad",
    **dict.fromkeys((3, 4, 5), " {:.2f} rad"),
    6: " {:.0f} rad/s2",
    9: " {:+.3f} rad",
    **dict.fromkeys((11, 12, 13, 14), "{:+.4f} rad"),
    15: "reference {:.2f} rad",
    16: "({:.1f} V",
    17: " {:,.0f} V/s",
}
"""How a sentence has the first number of a cause."""
