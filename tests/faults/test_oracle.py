"""The oracle sees what it is there for: boards that break a rule each, under faults that tempt them to."""

from __future__ import annotations

import pytest

from dcmp_hil.wire import cobs
from dcmp_hil.wire.codec import pack, unpack
from dcmp_hil.wire.messages import Drive, State
from sim_backend.board.board import Board
from tests.faults.matrix import judge
from tests.faults.oracle import Oracle
from tests.faults.rows import Row

pytestmark = pytest.mark.untraced


class TakesOldCommands(Board):
    """A board that accepts commands of any age."""

    def receive(self, data: bytes) -> None:
        frame = next(iter(cobs.CobsDecoder().feed(data)), None)
        message = None if frame is None else unpack(frame)
        if isinstance(message, Drive):
            data = cobs.encode(pack(message._replace(seq=(self.tick_count - 1) % 8192)))
        super().receive(data)


class HasNoWatchdog(Board):
    """Repeats the last command to itself for ever."""

    _last: Drive | None = None

    def receive(self, data: bytes) -> None:
        frame = next(iter(cobs.CobsDecoder().feed(data)), None)
        message = None if frame is None else unpack(frame)
        self._last = message if isinstance(message, Drive) else self._last
        super().receive(data)

    def tick(self) -> None:
        if self._last is not None and self.state == State.RUN:
            again = self._last._replace(seq=(self.tick_count - 1) % 8192)
            self.receive_frame(*pack(again))
        super().tick()


class ForgetsFaults(Board):
    """Says that it is IDLE a while after a fault."""

    _faulty = 0

    def tick(self) -> None:
        super().tick()
        self._faulty += super().state == State.FAULT

    @property
    def state(self) -> int:
        return State.IDLE if self._faulty > 5 else super().state


class StaysOn(Board):
    """Leaves the amplifier on in a fault."""

    @property
    def enable(self) -> bool:
        return super().enable or self.state == State.FAULT


class PutsOutTooMuch(Board):
    """Ignores the limit."""

    @property
    def applied_mV(self) -> int:
        return 100 * super().applied_mV


@pytest.mark.parametrize(
    ("make", "fault", "says"),
    [
        (TakesOldCommands, "wire.delay:ms=10,way=up", "a command was accepted"),
        (TakesOldCommands, "wire.delay:ms=10,way=up", "no host with a right to asked for it"),
        (HasNoWatchdog, "wire.blackhole:way=up", "ticks after the last good command"),
        (ForgetsFaults, "firmware.stop", "no host cleared it"),
        (StaysOn, "firmware.stop", "ENABLE True in state 4"),
        (PutsOutTooMuch, "firmware.stop", "10000 allowed"),
    ],
)
def test_oracle_sees_a_board_that_breaks_a_rule(make: type[Board], fault: str, says: str) -> None:
    row = Row(fault)
    assert any(says in violation for violation in judge(row, 1, make=make).violations)
    assert not any(says in violation for violation in judge(row, 1).violations)


def test_oracle_sees_a_number_that_is_none() -> None:
    oracle = Oracle()
    oracle.wrote(float("nan"))
    assert "hands nan V" in oracle.violations[0]


@pytest.mark.parametrize(
    ("row", "says"),
    [
        (Row("plant.power", bound_ms=1.0), "the bound is 1.0"),
        (Row("plant.motor_sign", most_rad_s=0.1), "the envelope is 0.1"),
        (Row("plant.motor_sign", most_rad=0.01), "the envelope is 0.01"),
        (Row("plant.offset:V=1,for=0.6s", settled_mrad=0.001), "0.001 are allowed"),
    ],
)
def test_bounds_of_a_row_are_held_against_the_run(row: Row, says: str) -> None:
    assert any(says in violation for violation in judge(row, 2).violations)
