"""The wires of a board: at which pin each ends, and whether that pin leads to the chip's peripheral."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from tests.target.machine.clocks import Gpio
    from tools.boards import Board

_LEADS = {
    "ENCODER_A": (1, ("PA0", "PA5", "PA15")),
    "ENCODER_B": (1, ("PA1", "PB3")),
    "SERIAL_TX": (7, ("PA9", "PB6")),
    "SERIAL_RX": (7, ("PA10", "PB7")),
    "CAN_RX": (9, ("PA11", "PB8", "PD0")),
    "CAN_TX": (9, ("PA12", "PB9", "PD1")),
    "PWM": (1, ("PA8", "PE9")),
    "BREAK": (1, ("PA6", "PB12", "PE15")),
}
"""Alternate functions, and the pins that have them: DS8626, table 9."""
_ANALOG = 3


class Wires:
    """The wires of a board, by the keys of its board.h.

    Parameters
    ----------
    board
        Whose wires they are.
    ports
        The chip's ports by their letters.
    """

    def __init__(self, board: Board, ports: Mapping[str, Gpio]) -> None:
        self._pins, self._ports = board.pins, ports

    def _at(self, key: str) -> tuple[Gpio, int]:
        pin = self._pins[key]
        return self._ports[pin[1]], int(pin[2:])

    def leads(self, key: str) -> bool:
        """Whether the pin leads to its peripheral; False on a board without this wire."""
        if key not in self._pins:
            return False
        port, number = self._at(key)
        function, pins = _LEADS[key]
        return self._pins[key] in pins and port.function(number) == function

    def is_analog(self, key: str) -> bool:
        """Whether the pin is an analog one; False on a board without this wire."""
        if key not in self._pins:
            return False
        port, number = self._at(key)
        return port.mode(number) == _ANALOG

    def level(self, key: str) -> bool:
        """Return what the chip puts on the wire; low where it drives nothing."""
        port, number = self._at(key)
        return port.level(number)

    def outside(self, key: str) -> bool:
        """Return what the world puts on the wire."""
        port, number = self._at(key)
        return bool(port.outside >> number & 1)

    def drive(self, key: str, *, high: bool) -> None:
        """Let the world put a level on the wire, if the board has it."""
        if key in self._pins:
            port, number = self._at(key)
            port.outside = port.outside & ~(1 << number) | high << number
