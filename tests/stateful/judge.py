"""The oracle of the fault matrix, and what it can say of a run that is made step by step."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.wire.messages import SampleReport, State
from tests.faults.oracle import Oracle

if TYPE_CHECKING:
    from collections.abc import Callable

_REMEMBERED_PIECES_MAX = 64  # pieces that reached the board, to be sent again


class Judge(Oracle):
    """Sees everything, and lets others know of every tick."""

    def __init__(self, *, first_tick: int, ticked: Callable[[], None]) -> None:
        super().__init__(first_tick=first_tick)
        self.told = int(State.BOOT)  # state in the newest SAMPLE
        self.heard_pieces: list[bytes] = []
        self._ticked = ticked

    def note(self, sentence: str) -> None:
        """Add a violation that another part of the test found."""
        self._note(sentence)

    @property
    def newest(self) -> int:
        """Tick of the newest SAMPLE."""
        return self._tick

    def heard(self, piece: bytes) -> None:
        super().heard(piece)
        self.heard_pieces = [*self.heard_pieces[1 - _REMEMBERED_PIECES_MAX :], piece]

    def said(self, piece: bytes) -> None:
        super().said(piece)
        if isinstance(self._sample, SampleReport):
            self.told = self._sample.state

    def fetched(self) -> None:
        super().fetched()
        self._ticked()

    def was_reset(self) -> None:
        """Reset the judge's state after a reset of the board."""
        self._ears.feed(b"\0")
        self._drives, self._good = [], []
        self._state, self._voltage, self._tick = int(State.BOOT), 0, -1
