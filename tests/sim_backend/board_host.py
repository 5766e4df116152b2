"""A small host, in frames, for a board in this process."""

from __future__ import annotations

from typing import Any, TypeVar

from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import (
    Drive,
    Hello,
    ParameterGet,
    ParameterValue,
    SampleReport,
    State,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH
from sim_backend.board.board import Board
from tests.helpers import bench

SESSION = 0x1234
Asked = TypeVar("Asked")


class Host:
    """As little of a host as will do, in frames."""

    def __init__(self, *overrides: str, **of_board: Any) -> None:
        self.rig = bench(*overrides)
        self.board = Board(self.rig, carrier="can", **of_board)
        self.seq = of_board.get("first_tick", 0) - 1
        self.heard: list[object] = []

    def say(self, message: Any) -> None:
        self.board.receive_frame(*pack(message, 0))

    def listen(self, kind: type[Asked]) -> list[Asked]:
        """Return what came since it was last asked for, of one kind."""
        messages = [unpack(frame, 0) for frame in self.board.transmit_frames()]
        self.heard += messages
        return [message for message in messages if isinstance(message, kind)]

    def tick(self) -> SampleReport:
        self.board.tick()
        self.seq += 1
        (sample,) = self.listen(SampleReport)
        return sample

    def drive(self, voltage_mV: int, *, arm: bool = True) -> None:
        self.say(Drive(voltage_mV, self.seq & 0x1FFF, arm, False, False, SESSION, 20))

    def arm(self) -> int:
        """Arm; return the number of the SAMPLE that the next DRIVE answers."""
        self.tick()
        self.say(Hello(SESSION, PROTOCOL_HASH))
        for _ in range(11):
            self.drive(0)
            self.tick()
        assert self.board.state == State.RUN
        return self.board.tick_count - 1

    def parameter(self, number: int) -> int:
        self.say(ParameterGet(number))
        (answer,) = self.listen(ParameterValue)
        return answer.value
