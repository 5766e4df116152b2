"""Faults of a device, and what other hosts send to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.wire.carriers import DECODERS, ENCODERS
from dcmp_hil.wire.codec import CorruptFrameError, pack, unpack
from dcmp_hil.wire.messages import Drive, Hello, Identity, Stop
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from sim_backend.faults.fault_model import FaultModel, Kind, Number
from sim_backend.faults.wire import WireFault

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message
    from sim_backend.board.board import Board
    from sim_backend.board.plant_io import PlantIO
    from sim_backend.faults.wire import Way
    from sim_backend.pacer import Pacer

_SEQUENCE_MASK, _UINT32_MAX = 0x1FFF, 2.0**32 - 1


class Reset(FaultModel):
    """Resets the board once."""

    _done = False

    def tick(self, board: Board | None) -> None:
        """Reset the board in the first period."""
        if board is not None and not self._done:
            board.reset()
        self._done = True


class WrongClock(FaultModel):
    """The device's clock is off: what it calls a period is shorter or longer."""

    of: tuple[Pacer, PlantIO]
    """The board's clock and what it moves; put in by the injector."""

    def begin(self) -> None:
        """Set the wrong rate."""
        self._stretch(1.0 / self._rate)

    def end(self) -> None:
        """Restore the right rate."""
        self._stretch(self._rate)

    def _stretch(self, factor: float) -> None:
        for what in self.of:
            what.stretch(factor)

    @property
    def _rate(self) -> float:
        return 1.0 + 1e-2 * self.number("percent")


class RogueHost(FaultModel):
    """Sends the device something that its host has not sent; `times` times, one a period."""

    _said = 0

    def tick(self, board: Board | None) -> None:
        """Send the message to the board."""
        if board is not None and self._said < self.number("times"):
            self._said += 1
            board.receive_frame(*pack(self.message(board), self.facts.node))

    def message(self, board: Board) -> Message:  # noqa: ARG002
        """Return the message that is injected."""
        return Stop(round(self.number("reason")))

    def other(self, board: Board) -> int:
        """Return a session that does not own the device."""
        number = self.rng.randrange(1, 0xFFFF)
        return number + (number >= board.owner > 0)


class RogueHello(RogueHost):
    """Another host wants the device."""

    def message(self, board: Board) -> Message:
        """Return a HELLO of another session."""
        return Hello(self.other(board), PROTOCOL_HASH)


class RogueDrive(RogueHost):
    """Another host drives the device."""

    def message(self, board: Board) -> Message:
        """Return a DRIVE of another session."""
        seq = (board.tick_count - 1) & _SEQUENCE_MASK
        return Drive(round(1e3 * self.number("V")), seq, True, False, False, self.other(board), 20)


class OtherVersion(WireFault):
    """The device reports another protocol hash."""

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:
        """Return IDENTITY with its hash changed."""
        frames = self._frames(piece)
        message = self._understood(frames[0]) if way == "down" and len(frames) == 1 else None
        if not isinstance(message, Identity):
            return (piece,)
        other = message._replace(protocol_hash=PROTOCOL_HASH ^ 1, mismatch=True, owned=False)
        return (self._piece(pack(other, self.facts.node)),)

    def _understood(self, frame: Frame) -> Message | None:
        try:
            return unpack(frame, self.facts.node)
        except CorruptFrameError:
            return None

    def _frames(self, piece: bytes) -> list[Frame]:
        if self.facts.carrier == "can":
            return [(int.from_bytes(piece[:2], "little"), piece[2:])]
        return DECODERS[self.facts.carrier]().feed(piece)

    def _piece(self, frame: Frame) -> bytes:
        if self.facts.carrier == "can":
            number, data = frame
            return number.to_bytes(2, "little") + data
        return ENCODERS[self.facts.carrier](frame)


class Start(FaultModel):
    """Boots the device with counters near their wrap; only `at=boot` means anything."""


_REPETITIONS_PARAMETER = Number("", 1, 1e6, 1)
FIRMWARE = {
    "firmware.reset": Kind(Reset, "the device is reset", wired=True),
    "firmware.stop": Kind(
        RogueHost,
        "STOP is sent by another host",
        {"reason": Number("", 0, 255, 3), "times": _REPETITIONS_PARAMETER},
        wired=True,
    ),
    "firmware.hello": Kind(
        RogueHello, "another host wants the device", {"times": _REPETITIONS_PARAMETER}, wired=True
    ),
    "firmware.drive": Kind(
        RogueDrive,
        "another host drives the device",
        {"V": Number("V", -32, 32, 5), "times": _REPETITIONS_PARAMETER},
        wired=True,
    ),
    "firmware.version": Kind(OtherVersion, "the device speaks another protocol", wired=True),
    "firmware.clock": Kind(
        WrongClock,
        "the device's clock is fast, or slow where it is negative",
        {"percent": Number("%", -50, 100, 2)},
        wired=True,
    ),
    "firmware.start": Kind(
        Start,
        "the device boots with its counters here",
        {
            "us": Number("us", 0, _UINT32_MAX, 0xFFFF_0000),
            "tick": Number("", 0, _UINT32_MAX, 0),
            "count": Number("counts", -(2.0**31), 2.0**31 - 1, 0),
        },
        wired=True,
    ),
}
