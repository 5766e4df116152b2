"""A device written from docs/protocol.md alone, without a look at the firmware."""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tests.contract import reference_wire as wire
from tests.contract.reference_motion import Motion
from tests.contract.reference_wire import ARMING, BOOT, FAULTED, IDLE, RUN

if TYPE_CHECKING:
    from collections.abc import Iterator

HASH = wire.protocol_hash()
FIRMWARE_VERSION = 1 * 256 + 0


@dataclass(kw_only=True, eq=False)
class ReferenceDevice:
    """The device: bytes or frames in and out, `tick` for each period, `advance` for the time between."""

    carrier: str = "cobs"
    node: int = 0
    counts_per_rev: int = 4096
    period_us: int = 1000
    voltage_limit_mV: int = 10_000
    slew_mV_per_ms: int = 0
    watchdog_ms: int = 20
    speed_limit_counts_s: int = 32_768
    travel_limit_counts: int = 16_384
    start_us: int = 0
    first_tick: int = 0

    def __post_init__(self) -> None:
        self.now_us = self.start_us
        self.tick_count = self.first_tick  # of the newest SAMPLE
        self.state = BOOT
        self._reach = -(-3000 // self.period_us)
        self._tenth_s = -(-100_000 // self.period_us)
        self._periods = 0
        self._line = wire.LINES[self.carrier]()
        self._link_up = True
        self._outbox = wire.Outbox()
        self._recent: deque[bool] = deque(maxlen=100)  # True for a corrupt frame
        self._crc_errors = self._gaps = self._bus_offs = 0
        self._parameters = wire.Parameters(
            limits={
                wire.VOLTAGE_LIMIT: self.voltage_limit_mV,
                wire.SLEW: self.slew_mV_per_ms,
                wire.WATCHDOG: self.watchdog_ms,
                wire.SPEED_LIMIT: self.speed_limit_counts_s,
                wire.TRAVEL_LIMIT: self.travel_limit_counts,
            },
            facts={wire.COUNTS_PER_REV: self.counts_per_rev, wire.PERIOD_US: self.period_us},
        )
        self._set = self._parameters.now
        self._owner, self._heard_us, self._last_seq, self._may_clear = 0, 0, -1, False
        self._begin_session(0)
        self._drive_us = self._ttl_ms = 0
        self._fed = False  # a DRIVE was accepted since the last tick
        self._armed = 0
        self._output_uV = self._wanted_mV = 0
        self._fault = (0, 0, 0)  # code, tick, detail
        self._fault_fresh = False
        self._fault_told = 0
        self._motion = Motion(self.period_us)

    # ---------------------------------------------------------------- what is seen from outside

    @property
    def applied_mV(self) -> int:
        """Output voltage of the amplifier, mV."""
        return int(self._output_uV / 1000)

    @property
    def enable(self) -> bool:
        """The amplifier's ENABLE line."""
        return self.state == RUN

    def receive(self, data: bytes) -> None:
        """Take bytes from the host."""
        for frame in self._line.feed(data):
            if frame is None:
                self._corrupt()
            else:
                self.receive_frame(*frame)

    def transmit(self) -> bytes:
        """Return the bytes for the host since the last call."""
        answers, self._line.answers = self._line.answers, b""
        return answers + self._line.pack(self.transmit_frames()) if self._link_up else b""

    def receive_frame(self, id: int, data: bytes) -> None:  # noqa: A002 - the interface's word
        """Process one frame from the host."""
        number, node = divmod(id, 16)
        if node != self.node or number not in wire.TO_DEVICE or len(data) != wire.LENGTHS[number]:
            return
        if not wire.intact(id, data):
            self._corrupt()
            return
        self._recent.append(False)
        {
            wire.STOP: self._on_stop,
            wire.DRIVE: self._on_drive,
            wire.HELLO: self._on_hello,
            wire.GET: self._on_get,
            wire.SET: self._on_set,
        }[number](data[:-1])

    def transmit_frames(self) -> list[wire.Frame]:
        """Return the frames for the host since the last call."""
        if not self._link_up:
            return []
        self._set[wire.TICK] = self.tick_count & wire.VALUE_MAX
        told = self._parameters.told
        contents = [(n, told(*c) if n == wire.VALUE else c) for n, c in self._outbox.take()]
        return [wire.frame(number, self.node, content) for number, content in contents] * self._line.open

    def advance(self, us: int) -> None:
        """Let time pass between ticks."""
        self._pass(us)
        if self.state in {ARMING, RUN} and self._silent_us():
            self._trip(wire.HOST_SILENT, self._silent_us())

    def link(self, up: bool) -> None:
        """Set the link up or down."""
        if self._link_up and not up:
            self._bus_offs += self.carrier == "can"
            self._outbox.answers.clear()
            self._line.answers = b""
            self._trip(wire.LINK_DOWN, 0)
        self._link_up = up

    def tick(self, counts: int) -> None:
        """End one period and begin the next."""
        self._pass(self.period_us)
        if self.state == BOOT:
            self.state = IDLE
        else:
            self.tick_count += 1
        self._periods += 1
        jump = self._motion.latch(counts, self.tick_count, self.speed_limit_counts_s)
        noted_mV = self.applied_mV
        for code, detail in self._findings(jump):
            self._trip(code, detail)
        limited = self.state == RUN and self._apply()
        missed, self._fed = not self._fed, False
        self._gaps += missed and self.state in {ARMING, RUN}
        self._report(noted_mV, missed=missed, limited=limited)

    # ---------------------------------------------------------------- sending

    def _report(self, noted_mV: int, *, missed: bool, limited: bool) -> None:
        repeated = self.state == FAULTED and (self.tick_count - self._fault_told) % self._tenth_s == 0
        if self._fault_fresh or repeated:
            self._fault_told = self.tick_count if self._fault_fresh else self._fault_told
            self._fault_fresh = False
            code, tick, detail = self._fault
            self._send(wire.FAULT, struct.pack("<BBi", code, tick & 255, detail))
        fault_class = min(self._fault[0], 7) if self.state == FAULTED else 0
        flags = self.state + 8 * missed + 16 * limited + 32 * fault_class
        position = struct.pack("<I", self._motion.raw or 0)[:3]
        self._send(wire.SAMPLE, position + struct.pack("<hBB", noted_mV, self.tick_count & 255, flags))
        if self._periods % self._tenth_s == 0:
            counters = (self._crc_errors, self._gaps, self._outbox.overruns, self._bus_offs)
            self._send(wire.HEALTH, bytes([*(min(c, 255) for c in counters), 0, 100]))

    def _send(self, number: int, content: bytes) -> None:
        if self._line.open:
            self._outbox.send(number, content)

    # ---------------------------------------------------------------- receiving

    def _corrupt(self) -> None:
        self._crc_errors += 1
        self._recent.append(True)
        if self.state == RUN and sum(self._recent) >= 10:
            self._trip(wire.CORRUPT_LINK, sum(self._recent))

    def _on_stop(self, content: bytes) -> None:
        if self.state not in {BOOT, FAULTED}:
            self._latch_fault(wire.STOPPED, content[0])

    def _on_hello(self, content: bytes) -> None:
        session, theirs = struct.unpack("<HI", content)
        if session and theirs == HASH and self._owner in {0, session}:
            if self._owner == 0:
                self._begin_session(session)
            self._heard_us = self.now_us
        owned = session != 0 and self._owner == session
        flags = (self._owner != 0 and not owned) + 2 * owned + 4 * (theirs != HASH)
        self._outbox.answer(wire.IDENTITY, struct.pack("<IHB", HASH, FIRMWARE_VERSION, flags))

    def _on_get(self, content: bytes) -> None:
        self._outbox.answer(wire.VALUE, bytes([content[0], 0 if content[0] in self._set else wire.UNKNOWN]))

    def _on_set(self, content: bytes) -> None:
        session, id_, value = struct.unpack("<HBi", content)
        owner = session != 0 and session == self._owner
        if owner:
            self._heard_us = self.now_us
        result = self._parameters.change(id_, value, idle=self.state == IDLE, owner=owner)
        self._outbox.answer(wire.VALUE, bytes([id_, result]))

    def _on_drive(self, content: bytes) -> None:
        voltage_mV, word, session, ttl_ms = struct.unpack("<hHHB", content)
        seq, flags = word >> 3, word & 7
        if session == 0 or session != self._owner or not 5 <= ttl_ms <= 50 or flags not in {0, 1, 2, 4}:
            return
        step = 1 if self._last_seq < 0 else (seq - self._last_seq) % 8192
        if self.state == BOOT or (self.tick_count - seq) % 8192 > self._reach or not 1 <= step <= 4095:
            self._gaps += 1
            return
        self._last_seq, self._ttl_ms, self._fed = seq, ttl_ms, True
        self._drive_us = self._heard_us = self.now_us
        if flags == 4:
            if self.state != FAULTED:
                self._cut(IDLE)
            self._begin_session(0)
        else:
            self._obey(voltage_mV, flags == 1, flags == 2, step)

    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        starts = arm and voltage_mV == 0
        if self.state == IDLE and starts:
            self.state, self._armed = ARMING, 1
        elif self.state == ARMING:
            self._armed += 1
            if not starts or step > self._reach:
                self.state = IDLE
            elif self._armed == wire.ARMING_DRIVES:
                self.state, self._wanted_mV = RUN, 0
                self._motion.armed()
        elif self.state == RUN:
            self._wanted_mV = voltage_mV
            if not arm:
                self._cut(IDLE)
        elif self.state == FAULTED:
            ends = self._may_clear and clear and voltage_mV == 0
            self._may_clear |= not clear
            self.state = IDLE if ends else FAULTED

    # ---------------------------------------------------------------- time, limits, output

    def _begin_session(self, session: int) -> None:
        self._owner = session
        self._heard_us = self.now_us
        self._last_seq = -1
        self._may_clear = False
        self._parameters.restore()

    def _pass(self, us: int) -> None:
        self.now_us += us
        if self.state not in {ARMING, RUN} and self.now_us - self._heard_us >= wire.LEASE_US:
            self._begin_session(0)

    def _silent_us(self) -> int:
        age = self.now_us - self._drive_us
        return age if age > 1000 * min(self._set[wire.WATCHDOG], self._ttl_ms) else 0

    def _findings(self, jump: int) -> Iterator[tuple[int, int]]:
        if self.state == RUN:
            speeds = self.speed_limit_counts_s, self._set[wire.SPEED_LIMIT]
            yield from self._motion.limits(jump, speeds, self._travel_limits())
        if self.state in {ARMING, RUN} and self._silent_us():
            yield wire.HOST_SILENT, self._silent_us()
        if not self._link_up:
            yield wire.LINK_DOWN, 0

    def _travel_limits(self) -> list[tuple[int, int]]:
        """Return origins and limits: a session's, and what counts from the first arming."""
        origin, limit = self._set[wire.TRAVEL_ORIGIN], self._set[wire.TRAVEL_LIMIT]
        return [(-1, limit)] if origin < 0 else [(origin, limit), (-1, self.travel_limit_counts)]

    def _trip(self, code: int, detail: int) -> None:
        """From RUN to FAULT, from ARMING to IDLE; the first cause stays."""
        if self.state == RUN:
            self._latch_fault(code, detail)
        elif self.state == ARMING:
            self.state = IDLE

    def _latch_fault(self, code: int, detail: int) -> None:
        self._cut(FAULTED)
        self._fault = (code, self.tick_count, max(-wire.VALUE_MAX - 1, min(detail, wire.VALUE_MAX)))
        self._fault_fresh, self._may_clear = True, False

    def _cut(self, state: int) -> None:
        self._output_uV = self._wanted_mV = 0
        self.state = state

    def _apply(self) -> bool:
        """Put the newest command out; return whether it was limited."""
        limit_mV, slew = self._set[wire.VOLTAGE_LIMIT], self._set[wire.SLEW]
        wanted = 1000 * max(-limit_mV, min(self._wanted_mV, limit_mV))
        most = slew * self.period_us if slew else abs(wanted - self._output_uV)
        self._output_uV = max(self._output_uV - most, min(wanted, self._output_uV + most))
        return self._output_uV != 1000 * self._wanted_mV
