"""Keeps a whole run in memory, as the columns of the table of signals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.telemetry.signals import columns

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event


class MemorySink:
    """A sink for results, figures and tests; about 140 bytes a period."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self._pieces: list[dict[str, NDArray[np.float64]]] = []

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        self._pieces.append({name: column.copy() for name, column in columns(block).items()})

    def event(self, event: Event) -> None:
        """Process an event."""
        self.events.append(event)

    def close(self) -> None:
        """Nothing to finish."""

    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Return every signal, shape (periods,), by column name."""
        if not self._pieces:
            return {}
        return {name: np.concatenate([piece[name] for piece in self._pieces]) for name in self._pieces[0]}
