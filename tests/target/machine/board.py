"""The machine as a board that ticks when a host waits, with the plant on its pins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim_backend.board.config import board_config
from sim_backend.board.plant_io import PlantIO
from tests.target.machine.system import System
from tools.boards import read_boards
from tools.record import RecordLink, image, record

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from dcmp_hil.config import Rig
    from dcmp_hil.values import Truth
    from tests.target.machine.ports import Frame
    from tools.boards import Board

_DAC_MV = 10_000
_SAID_US = 600.0  # by then it has said what there is to say of a tick
_SIGN_BIT = 1 << 31


class TargetBoard:
    """A bench board with the plant.

    Parameters
    ----------
    elf
        Its program.
    rig
        Whose record it has, and whose plant.
    carrier
        `cobs`, `slcan` or `can`.
    board
        Whose wires and number it has; None: the board of firmware/boards that the program is named after.
    options
        Of System.
    """

    def __init__(
        self, elf: Path, rig: Rig, carrier: str = "cobs", *, board: Board | None = None, **options: object
    ) -> None:
        board = board or read_boards()[elf.stem]
        kept = record(
            board_config(rig, board.number),
            link=RecordLink[carrier],
            full_scale_mV=rig.amplifier.supply_mV or _DAC_MV,
        )
        self.system = System(elf, image(kept), board=board, **options)  # type: ignore[arg-type]
        self.pins = PlantIO(rig)
        self.carrier = carrier
        self.period_us = 1e6 * rig.period
        self.ticks = 0
        self.turned: Callable[[float], int] | None = None  # the count, where a test turns the arm by hand
        self._frames: list[Frame] = []
        self.system.position = self._at_tick
        self.system.can.on_sent = self._heard

    def _heard(self, frame: Frame) -> bool:
        self._frames.append(frame)
        return True

    def _at_tick(self, now: float) -> int:
        self.ticks += 1
        if self.ticks > 1:
            self.pins.advance(round(self.system.amplifier_mV))
        count = self.pins.count() if self.turned is None else self.turned(now)
        return count - 2 * (count & _SIGN_BIT)

    def tick(self) -> None:
        """Let the next tick come, and what follows from it."""
        before = self.ticks
        for _ in range(1000):
            self.system.run_for(50.0)
            if self.ticks > before:
                self.system.run_for(_SAID_US)
                return
        raise AssertionError(f"no tick: {self.system.misuse} {self.system.faults} {self.system.resets}")

    def receive(self, data: bytes) -> None:
        """Let bytes come in, at the pace of the line."""
        self.system.usart.hear(data)

    def receive_frame(self, number: int, data: bytes) -> None:
        """Let a frame come in."""
        self.system.can.hear((number, data))

    def transmit(self) -> bytes:
        """Return the bytes that the board has sent."""
        sent = bytes(self.system.usart.sent)
        self.system.usart.sent.clear()
        return sent

    def transmit_frames(self) -> list[Frame]:
        """Return the frames that the board has sent."""
        sent, self._frames = self._frames, []
        return sent

    @property
    def enable(self) -> bool:
        """Whether the amplifier is switched on."""
        return self.system.enable

    def truth(self) -> Truth:
        """Return the true state at the last tick."""
        return self.pins.truth
