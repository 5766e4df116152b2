"""The judge of every run with a fault: sees the plant's truth, the firmware's own state, and the wire."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dcmp_hil.wire import cobs
from dcmp_hil.wire.codec import CorruptFrameError, unpack
from dcmp_hil.wire.messages import Drive, SampleReport, State
from sim_backend.faults.listener import FaultListener

if TYPE_CHECKING:
    from dcmp_hil.wire.messages import Message
    from sim_backend.board.board import Board

AGE_MAX_TICKS = 3  # ticks at 1 kHz: a command computed from an older sample may not be accepted
_SEQ, _SEEN_MAX = 0x2000, 1000


class Oracle(FaultListener):
    """Checks a board on the carrier `cobs` in every tick; what it finds is in `violations`.

    It believes nothing that the firmware says of itself but state, voltage and ENABLE; which commands were
    good it works out from the bytes that reached the board.
    """

    def __init__(self, *, limit_mV: int = 10_000, watchdog: int = 20, first_tick: int = 0) -> None:
        self.violations: list[str] = []
        self.off_at: int | None = None  # tick (of the board, from its making) since which it is not in RUN
        self.peak_rad = self.peak_rad_s = 0.0
        self.ran = False
        self._limit_mV, self._watchdog = limit_mV, watchdog
        self._ears, self._mouth = cobs.CobsDecoder(), cobs.CobsDecoder()
        self._board: Board | None = None
        self._ticks = 0  # of the board, judged
        self._tick = first_tick - 1  # of the newest SAMPLE
        self._sample: SampleReport | None = None
        self._drives: list[Drive] = []  # heard since the last tick
        self._good: list[Drive] = []  # those of them that may be accepted
        self._good_at = 0  # tick after the newest of these
        self._state, self._voltage = int(State.BOOT), 0

    @property
    def ticks(self) -> int:
        """Ticks of the board so far, since it was made."""
        return self._ticks

    def attached(self, board: Board | None) -> None:
        self._board = board
        if board is not None and not self._ticks:
            self._ticks = self._good_at = board.tick_count
            self._state, self._voltage = board.state, board.applied_mV

    def heard(self, piece: bytes) -> None:
        for frame in self._ears.feed(piece):
            message = _understood(frame)
            if isinstance(message, Drive):
                self._drives.append(message)
                if self._is_good(message):
                    self._good.append(message)

    def said(self, piece: bytes) -> None:
        for frame in self._mouth.feed(piece):
            message = _understood(frame)
            if isinstance(message, SampleReport):
                self._sample = message

    def fetched(self) -> None:
        """Judge, once a tick."""
        board = self._board
        assert board is not None
        if board.tick_count == self._ticks:
            return
        self._ticks = board.tick_count
        self._judge(board)
        self._drives, self._good = [], []
        self._sample = None
        self._state, self._voltage = board.state, board.applied_mV

    def wrote(self, voltage: float) -> None:
        if not math.isfinite(voltage):
            self._note(f"the loop hands {voltage} V to the backend")

    def _is_good(self, drive: Drive) -> bool:
        assert self._board is not None
        return drive.session == self._board.owner != 0 and (self._tick - drive.seq) % _SEQ <= AGE_MAX_TICKS

    def _judge(self, board: Board) -> None:
        if self._good:
            self._good_at = self._ticks
        self._look_at_output(board)
        self._look_at_command(board)
        self._look_at_fault(board)
        self._look_at_plant(board)
        sample, following = self._sample, self._tick + 1
        counts_on = sample is None or sample.tick == following & 0xFF
        self._tick = following if counts_on or sample is None else sample.tick  # after a reset it counts anew

    def _look_at_output(self, board: Board) -> None:
        voltage, running = board.applied_mV, board.state == State.RUN
        if not abs(voltage) <= self._limit_mV:
            self._note(f"{voltage} mV put out, {self._limit_mV} allowed")
        if not running and (voltage or board.enable):
            self._note(f"{voltage} mV, ENABLE {board.enable} in state {board.state}")
        silent = self._ticks - self._good_at
        if silent > self._watchdog and (voltage or running):
            self._note(f"{voltage} mV, state {board.state}, {silent} ticks after the last good command")

    def _look_at_command(self, board: Board) -> None:
        sample, voltage = self._sample, board.applied_mV
        if sample is not None and not sample.missed and not self._good:
            self._note(f"a command was accepted, and none of {self._drives} may be (tick {self._tick})")
        allowed = {self._voltage, 0, *(self._clamped(drive.voltage_mV) for drive in self._good)}
        if voltage not in allowed:
            self._note(f"{voltage} mV put out, and no host with a right to asked for it: {self._drives}")

    def _clamped(self, voltage_mV: int) -> int:
        return max(-self._limit_mV, min(self._limit_mV, voltage_mV))

    def _look_at_fault(self, board: Board) -> None:
        left = self._state == State.FAULT and board.state not in (State.FAULT, State.BOOT)
        was_reset = self._sample is not None and self._sample.tick != (self._tick + 1) & 0xFF
        if left and not was_reset and not any(drive.clear and not drive.voltage_mV for drive in self._good):
            self._note(f"the fault was left for state {board.state}, and no host cleared it")

    def _look_at_plant(self, board: Board) -> None:
        position, velocity, _ = board.truth()
        self.peak_rad = max(self.peak_rad, abs(position))
        self.peak_rad_s = max(self.peak_rad_s, abs(velocity))
        if board.state == State.RUN:
            self.ran, self.off_at = True, None
        elif self.off_at is None:
            self.off_at = self._ticks

    def _note(self, sentence: str) -> None:
        if len(self.violations) < _SEEN_MAX:
            self.violations.append(f"tick {self._ticks}: {sentence}")


def _understood(frame: object) -> Message | None:
    try:
        return unpack(frame)  # type: ignore[arg-type]
    except CorruptFrameError:
        return None
