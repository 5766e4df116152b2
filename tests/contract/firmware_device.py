"""The firmware's C behind the interface of the reference device, so that both answer the same questions."""

from __future__ import annotations

from sim_backend.board.board import Board
from tests.helpers import bench


class _Counter:
    """PlantIO that show what a test says, and move nothing."""

    counts = 0

    def advance(self, voltage_mV: int) -> None:
        """Do nothing: the test turns the encoder."""

    def count(self) -> int:
        """Return the encoder's count."""
        return self.counts & 0xFFFF_FFFF


class Firmware(Board):
    """A board whose counts come from the test."""

    def __init__(
        self, *, carrier: str = "cobs", start_us: int = 0, first_tick: int = 0, **built: int
    ) -> None:
        super().__init__(bench(), carrier=carrier)
        self._config |= {"speed_limit_counts_s": 32_768, "travel_limit_counts": 16_384} | built
        self._period_us = self._config["period_us"]
        self.now_us = start_us & 0xFFFF_FFFF
        self._boot(first_tick)
        self._counter = _Counter()
        self.pins = self._counter  # type: ignore[assignment]

    def tick(self, counts: int) -> None:  # type: ignore[override]
        """Let a period pass, the encoder showing `counts`."""
        self.tick_count += 1
        self._counter.counts = counts
        super().tick()

    def link(self, up: bool) -> None:
        """Plug or unplug the line."""
        super().link(up=up)
