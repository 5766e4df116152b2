"""The reference device with the plant on its pins: a judge of the host that knows only the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim_backend.board.config import SIMULATED, board_config
from sim_backend.board.plant_io import PlantIO
from tests.contract.reference_device import ReferenceDevice

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.values import Truth

_BUILT = (
    *("node", "counts_per_rev", "period_us", "voltage_limit_mV", "slew_mV_per_ms", "watchdog_ms"),
    *("speed_limit_counts_s", "travel_limit_counts"),
)


class ReferenceBoard(ReferenceDevice):
    """The counterpart of `sim_backend.board.board.Board` for this device."""

    def __init__(
        self, rig: Rig, *, carrier: str, count_offset: int = 0, start_us: int = 0, first_tick: int = 0
    ) -> None:
        built = board_config(rig, SIMULATED)
        super().__init__(
            carrier=carrier,
            start_us=start_us,
            first_tick=first_tick,
            **{name: built[name] for name in _BUILT},
        )
        self.pins = PlantIO(rig, count_offset)

    def tick(self) -> None:  # type: ignore[override]
        """Let a period pass."""
        self.pins.advance(self.applied_mV)
        super().tick(self.pins.count())

    def reset(self) -> None:
        """Reset the device; the plant keeps its state."""
        self.first_tick, self.start_us = 0, self.now_us
        self.__post_init__()

    def truth(self) -> Truth:
        """Return the true state."""
        return self.pins.truth
