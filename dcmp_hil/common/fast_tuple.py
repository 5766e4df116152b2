"""A named tuple in half the time of its own constructor, checked by the type checker like it.

The constructor of a NamedTuple is Python code that calls `tuple.__new__`. A cycle makes five, seven with the
simulated rig, eight with a wire. Measured in CPU time: 0.09 us less for Timing, Reference, Estimate and
Sample, 0.08 for Truth, 0.11 for Cycle and Drive, 0.12 for SampleReport (medians of 15 pairs; quartiles within
0.01, 0.03 for SampleReport). Whole cycles, pairs in turn: 0.7 us of 10.6 on the simulated rig for the first
five (ratio 0.93, quartiles 0.92 and 0.95), 0.4 us of 18 for the three of the wire (0.98, quartiles 0.94 and
1.00). So it stays in the cycle, and is used nowhere else by hand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeVarTuple

    _Made = TypeVar("_Made")
    _Fields = TypeVarTuple("_Fields")

    def make(kind: Callable[[*_Fields], _Made], fields: tuple[*_Fields]) -> _Made:
        """Return ``kind(*fields)``; `fields` are all of them, those with a default too."""
        ...
else:
    make = tuple.__new__
