"""What boards with a chip share: bytes in and out, faults that are remembered, who has to be alive."""

from __future__ import annotations

from typing import Any

import pytest
from fastcrc import crc16

from dcmp_hil.values import Fault
from tests.firmware.bench import SESSION, Core, cobs_wire, decode, encode, slcan_wire, unstuff

IDLE, ARMING, RUN, FAULT = 1, 2, 3, 4
NO_RECORD = 2


class Board:
    """A board with a chip, without the chip."""

    def __init__(
        self, core: Core, *, slcan: bool = False, failure: int = 0, log: Any = None, **config: Any
    ) -> None:
        self.core, self.lib, self.now = core, core.lib, 0
        self.slcan = slcan
        self.log = core.new("struct fault_log *") if log is None else log
        self.app = core.new("struct app *")
        self.lib.app_start(self.app, core.config(**config), int(slcan), self.log, failure, self.now)

    def tick(self, times: int = 1, **changes: Any) -> tuple[int, bool]:
        out = None
        for _ in range(times):
            self.now += 1000
            tick = self.core.new("struct app_tick *", {"now_us": self.now, **changes})
            out = self.lib.app_tick(self.app, tick)
        assert out is not None
        return out.voltage_mV, out.enable

    def hear(self, data: bytes) -> tuple[int, bool]:
        assert self.lib.ring_put(core_ring(self.app.received, self.core), data, len(data))
        while True:
            before = self.app.received.read
            out = self.lib.app_serve_bytes(self.app, self.now)
            if self.app.received.read in (before, self.app.received.written):
                return out.voltage_mV, out.enable

    def say(self, name: str, **fields: int) -> tuple[int, bool]:
        wire = slcan_wire if self.slcan else cobs_wire
        return self.hear(wire(*encode(name, 0, **fields)))

    def said(self) -> bytes:
        self.lib.app_say(self.app)
        out = self.core.new("uint8_t[]", 1024)
        length = self.lib.ring_take(core_ring(self.app.sending, self.core), out, 1024)
        return bytes(out[0:length])

    def messages(self) -> list[tuple[str, dict[str, Any]]]:
        bodies = [unstuff(part) for part in self.said().split(b"\0") if part]
        return [decode(int.from_bytes(body[:2], "little"), body[2:-2]) for body in bodies]

    def arm(self, voltage_mV: int = 1000) -> tuple[int, bool]:
        self.say("HELLO", session=SESSION, protocol_hash=self.lib.check_protocol_hash())
        for i in range(12):
            self.tick()
            self.drive(voltage_mV if i > 9 else 0)
        return self.tick()

    def drive(self, voltage_mV: int, **flags: int) -> None:
        filled = {"seq": self.app.device.tick % 8192, "arm": 1, "clear": 0, "release": 0, "ttl_ms": 50}
        self.say("DRIVE", voltage_mV=voltage_mV, session=SESSION, **(filled | flags))

    def asked(self, number: int) -> int:
        self.say("PARAMETER_GET", id=number)
        return next(int(fields["value"]) for name, fields in self.messages() if name == "PARAMETER_VALUE")

    @property
    def state(self) -> int:
        return int(self.app.device.supervisor.state)

    @property
    def fault(self) -> tuple[str, int]:
        fault = self.app.device.supervisor.fault
        return Fault(fault.code).name, fault.detail

    def logged(self) -> list[tuple[int, int, str, int]]:
        found: list[tuple[int, int, str, int]] = []
        while entry := self.lib.fault_log_look(self.log, len(found)):
            found.append((entry.boot, entry.tick, Fault(entry.code).name, entry.detail))
        return found


def core_ring(ring: Any, core: Core) -> Any:
    return core.ffi.addressof(ring)


@pytest.mark.parametrize("slcan", [False, True], ids=["cobs", "slcan"])
def test_board_arms_and_drives_over_bytes(core: Core, slcan: bool) -> None:
    board = Board(core, slcan=slcan)
    if slcan:
        board.hear(b"O\r")
        assert board.said() == b"\r"
    board.tick()
    assert board.arm(1500) == (1500, True)
    assert board.state == RUN
    answers = board.app.answers
    assert answers == (14 if slcan else 13)  # HELLO, DRIVEs; slcan's opening
    board.say("PARAMETER_GET", id=1)
    assert board.app.answers == answers  # it is armed, and waits for a DRIVE
    board.drive(0, arm=0)
    assert board.tick() == (0, False)


def test_empty_frames_are_no_frames(core: Core) -> None:
    board = Board(core)
    board.hear(b"\0\0\0")
    assert board.app.answers == 0
    board.hear(b"\x01\0\0")
    assert board.app.answers == 1
    board.hear(b"\0")
    assert board.app.answers == 1


def test_fault_is_logged_once_and_survives_a_reset(core: Core) -> None:
    board = Board(core, boot_count=3)
    board.tick()
    board.arm()
    assert board.tick(22) == (0, False)
    assert board.state == FAULT
    age = board.fault[1]
    assert board.logged() == [(3, board.app.device.tick - 2, "HOST_SILENT", age)]
    board.tick(5)
    assert len(board.logged()) == 1
    after = Board(core, log=board.log, boot_count=4)
    after.tick()
    assert after.asked(13) == Fault.HOST_SILENT
    assert after.asked(14) == age
    after.say("STOP", reason=3)
    assert [entry[:1] + entry[2:3] for entry in after.logged()] == [(4, "STOPPED"), (3, "HOST_SILENT")]


@pytest.mark.parametrize("fill", [0x00, 0xFF, 0xA5], ids=hex)
def test_log_begins_anew_after_power_on(core: Core, fill: int) -> None:
    log = core.new("struct fault_log *")
    core.ffi.buffer(log)[:] = bytes([fill]) * core.ffi.sizeof("struct fault_log")
    assert Board(core, log=log).logged() == []


def test_log_that_was_damaged_begins_anew(core: Core) -> None:
    log = core.new("struct fault_log *")
    memory = core.ffi.buffer(log)
    core.lib.fault_log_open(log)
    assert log.crc == 0x10600000 | crc16.ibm_3740(bytes(memory)[:-4])
    core.lib.fault_log_add(log, core.new("struct fault_log_entry *", (1, 2, 3, 4)))
    core.lib.fault_log_open(log)
    assert core.lib.fault_log_look(log, 0).detail == 4
    for bit in range(8 * len(memory)):
        damaged = core.new("struct fault_log *", log[0])
        core.ffi.buffer(damaged)[bit // 8] = bytes([memory[bit // 8][0] ^ 1 << bit % 8])
        core.lib.fault_log_open(damaged)
        assert core.lib.fault_log_look(damaged, 0) == core.ffi.NULL


def test_log_keeps_the_newest_eight(core: Core) -> None:
    log = core.new("struct fault_log *")
    core.lib.fault_log_open(log)
    for n in range(11):
        core.lib.fault_log_add(log, core.new("struct fault_log_entry *", (n, n, 1, n)))
    boots = [core.lib.fault_log_look(log, back).boot for back in range(8)]
    assert boots == [10, 9, 8, 7, 6, 5, 4, 3]
    assert core.lib.fault_log_look(log, 8) == core.ffi.NULL


def test_failure_at_the_start_is_a_fault_that_a_person_may_clear(core: Core) -> None:
    board = Board(core, failure=NO_RECORD)
    board.tick()
    assert (board.state, board.fault) == (FAULT, ("INTERNAL", NO_RECORD))
    board.say("HELLO", session=SESSION, protocol_hash=board.lib.check_protocol_hash())
    board.tick()
    board.drive(0, arm=0)
    board.tick()
    board.drive(0, arm=0, clear=1)
    board.tick(2)
    assert board.state == IDLE


def test_broken_power_stage_stops_everything(core: Core) -> None:
    board = Board(core)
    board.tick()
    assert board.arm() == (1000, True)
    out = board.lib.app_fail(board.app, Fault.BREAK_INPUT, 0, board.now)
    assert (out.voltage_mV, out.enable) == (0, False)
    assert board.fault == ("BREAK_INPUT", 0)
    assert [entry[2] for entry in board.logged()] == ["BREAK_INPUT"]


@pytest.mark.parametrize(
    ("between_us", "period_us", "missed"),
    [(0, 1000, 0), (999, 1000, 0), (1000, 1000, 0), (1500, 1000, 0), (1501, 1000, 1), (2000, 1000, 1),
     (2499, 1000, 1), (2501, 1000, 2), (100, 100, 0), (25_600, 100, 255), (0xFFFF_FFFF, 100, 42_949_672)],
)  # fmt: skip
def test_periods_without_a_tick(core: Core, between_us: int, period_us: int, missed: int) -> None:
    assert core.lib.app_missed(between_us, period_us) == missed


@pytest.mark.parametrize(
    ("missed", "late", "counted"), [(1, False, 1), (3, True, 4), (254, False, 254), (1 << 31, True, 255)]
)
def test_ticks_that_were_missed_are_counted(core: Core, missed: int, late: bool, counted: int) -> None:
    board = Board(core)
    board.tick(missed=missed, late=late)
    board.tick(99)
    health = [fields for name, fields in board.messages() if name == "HEALTH"]
    assert health[-1]["late_ticks"] == counted


def test_health_counts_what_the_board_saw(core: Core) -> None:
    board = Board(core)
    board.app.idle_percent = 87
    board.app.lost = True
    board.tick(late=True)
    board.tick(99)
    health = [fields for name, fields in board.messages() if name == "HEALTH"]
    assert health[-1]["idle_percent"] == 87
    assert health[-1]["late_ticks"] == 1
    assert health[-1]["ring_overruns"] >= 1
    assert not board.app.lost


def test_lost_bytes_are_counted_once(core: Core) -> None:
    board = Board(core)
    for lost, counted in [(False, 0), (True, 1), (False, 1)]:
        board.app.lost = lost
        board.tick()
        board.said()
        assert board.app.device.health.report.ring_overruns == counted


def test_app_says_that_it_lives(core: Core) -> None:
    board = Board(core)
    for round_ in range(1, 4):
        board.tick()
        assert board.app.life.decisions == board.app.device.tick == round_ - 1
        board.hear(b"")
        assert board.app.life.receptions == round_


def test_answers_leave_at_once(core: Core) -> None:
    board = Board(core)
    assert core.lib.ring_is_empty(core_ring(board.app.sending, core))
    board.say("PARAMETER_GET", id=1)
    assert not core.lib.ring_is_empty(core_ring(board.app.sending, core))


def test_chunk_that_is_full_is_looked_at_to_its_end_and_no_further(core: Core) -> None:
    board = Board(core)
    board.hear(b"\x01\0" * 32 + b"\x01")
    assert board.app.answers == 1
    board.hear(b"\0")
    assert board.app.answers == 2


@pytest.mark.parametrize("room", [1024, 30, 1])
def test_what_has_no_room_waits(core: Core, room: int) -> None:
    """Sixteen answers in slcan are more than is put out at a time."""
    board = Board(core, slcan=True)
    board.hear(b"O\r")
    board.said()
    sending = core_ring(board.app.sending, core)
    assert core.lib.ring_put(sending, b"x" * 1024, 1024)
    asked = [*range(1, 16), 1]
    for number in asked:
        board.say("PARAMETER_GET", id=number)
    out = core.new("uint8_t[]", 1024)
    core.lib.ring_take(sending, out, room)
    core.lib.app_say(board.app)
    core.lib.ring_take(sending, out, 1024 - room)
    said = b"".join(board.said() for _ in range(6))
    frames = [frame.decode() for frame in said.split(b"\r") if frame]
    answers = [decode(int(frame[1:4], 16), bytes.fromhex(frame[5:])) for frame in frames]
    assert [fields["id"] for _, fields in answers] == asked


def test_answers_without_room_are_counted(core: Core) -> None:
    board = Board(core, slcan=True)
    assert board.lib.ring_put(core_ring(board.app.sending, core), b"x" * 1024, 1024)
    board.hear(b"V\r")
    assert board.app.device.health.report.ring_overruns == 1


def test_watchdog_is_fed_only_while_all_go_on(core: Core) -> None:
    life, seen = core.new("struct life *"), core.new("struct life *")
    assert not core.lib.life_goes_on(life, seen)
    for stuck in ("ticks", "receptions", "decisions") * 2:
        for part in ("ticks", "receptions", "decisions"):
            setattr(life, part, getattr(life, part) + (part != stuck))
        assert not core.lib.life_goes_on(life, seen), stuck
        setattr(life, stuck, getattr(life, stuck) + 1)
        assert core.lib.life_goes_on(life, seen), stuck
        assert not core.lib.life_goes_on(life, seen)
