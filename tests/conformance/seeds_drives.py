"""Errors of DRIVE and of the states: sections 6 and 7."""
# ruff: noqa: ARG002, SLF001 - an error is sown by overriding what the device does inside

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from tests.conformance.seed import Seed
from tests.contract import reference_wire as wire
from tests.contract.reference_wire import ARMING, FAULTED, IDLE, RUN

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.conformance.seed import Row


def drive_seed(change: Callable[[Any, int, int, int, int], tuple[int, int, int, int]]) -> type[Seed]:
    """Return a device that reads another DRIVE than was sent: (device, mV, word, session, ttl)."""

    class Drives(Seed):
        def _on_drive(self, content: bytes) -> None:
            changed = change(self, *struct.unpack("<hHHB", content))
            super()._on_drive(struct.pack("<hHHB", *changed))

    return Drives


class Deaf(Seed):
    def _on_drive(self, content: bytes) -> None:
        self.tick_count += 100
        super()._on_drive(content)
        self.tick_count -= 100


class RefusedCountsNothing(Seed):
    def _on_drive(self, content: bytes) -> None:
        gaps = self._gaps
        super()._on_drive(content)
        self._gaps = gaps


class DropsCount(Seed):
    def _on_drive(self, content: bytes) -> None:
        fed, gaps = self._fed, self._gaps
        self._fed = False
        super()._on_drive(content)
        self._gaps += not self._fed and self._gaps == gaps
        self._fed |= fed


def _any_age(device: Any, voltage: int, word: int, session: int, ttl: int) -> tuple[int, int, int, int]:
    seq = word >> 3
    old = (device.tick_count - seq) % 8192 > device._reach
    return voltage, (device.tick_count % 8192 << 3 | word & 7) if old else word, session, ttl


def _eight_bits(device: Any, voltage: int, word: int, session: int, ttl: int) -> tuple[int, int, int, int]:
    age = (device.tick_count - (word >> 3)) % 256
    return voltage, ((device.tick_count - age) % 8192) << 3 | word & 7, session, ttl


class ShortReach(Seed):
    def sow(self) -> None:
        self._reach -= 1


class LongReach(Seed):
    def sow(self) -> None:
        self._reach += 1


class AnyOrder(Seed):
    def _on_drive(self, content: bytes) -> None:
        self._last_seq = -1
        super()._on_drive(content)


class StopInRunOnly(Seed):
    def _on_stop(self, content: bytes) -> None:
        if self.state == RUN:
            super()._on_stop(content)


class LastCauseStays(Seed):
    def _on_stop(self, content: bytes) -> None:
        self._latch_fault(wire.STOPPED, content[0])


class FaultSeldom(Seed):
    def _report(self, noted_mV: int, *, missed: bool, limited: bool) -> None:
        if self.state == FAULTED and not self._fault_fresh:
            self._fault_told = self.tick_count - 1 - (self.tick_count % (3 * self._tenth_s) == 0)
        super()._report(noted_mV, missed=missed, limited=limited)


class FaultOnce(Seed):
    def _send(self, number: int, content: bytes) -> None:
        if number == wire.FAULT:
            self.faults_sent += 1
        if number != wire.FAULT or self.faults_sent == 1:
            super()._send(number, content)

    faults_sent = 0


class ClearsWithoutEdge(Seed):
    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        self._may_clear = True
        super()._obey(voltage_mV, arm, clear, step)


class ClearsWithVoltage(Seed):
    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        super()._obey(0 if clear else voltage_mV, arm, clear, step)


class NeverClears(Seed):
    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        super()._obey(voltage_mV, arm, False, step)


class ClearedByTwo(Seed):
    def _begin_session(self, session: int) -> None:
        kept = getattr(self, "_may_clear", False)
        super()._begin_session(session)
        self._may_clear = kept


class ReleaseClears(Seed):
    def _on_drive(self, content: bytes) -> None:
        super()._on_drive(content)
        if content[2] & 4 and self.state == FAULTED:
            self.state = IDLE


def arming_seed(drives: int) -> type[Seed]:
    class Arms(Seed):
        def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
            self._armed += (10 - drives) if self.state == IDLE else 0
            super()._obey(voltage_mV, arm, clear, step)
            if self.state == ARMING and self._armed == 1:
                self._armed += 10 - drives

    return Arms


class ArmingCountsOn(Seed):
    counted = 0

    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        before = self.state
        super()._obey(voltage_mV, arm, clear, step)
        if (before, self.state) == (IDLE, ARMING):
            self._armed = max(self._armed, self.counted)
        if self.state == ARMING:
            self.counted = self._armed


class ArmingWithGaps(Seed):
    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        super()._obey(voltage_mV, arm, clear, 1)


class ArmingWithVoltage(Seed):
    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        super()._obey(voltage_mV if self.state == RUN else 0, arm, clear, step)


class ArmingFaults(Seed):
    def _trip(self, code: int, detail: int) -> None:
        if self.state == ARMING:
            self._latch_fault(code, detail)
        super()._trip(code, detail)


class ArmingForEver(Seed):
    def _trip(self, code: int, detail: int) -> None:
        if self.state != ARMING:
            super()._trip(code, detail)


class ClearDoesNotDisarm(Seed):
    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        super()._obey(voltage_mV, arm or (clear and self.state == RUN), clear, step)


class VoltageStays(Seed):
    def _cut(self, state: int) -> None:
        kept = self._output_uV
        super()._cut(state)
        self._output_uV = kept


class FaultLeadsToRun(Seed):
    def _obey(self, voltage_mV: int, arm: bool, clear: bool, step: int) -> None:
        if self.state == FAULTED and arm:
            self.state = IDLE
        super()._obey(voltage_mV, arm, clear, step)


class EverybodyDrives(Seed):
    def _on_drive(self, content: bytes) -> None:
        voltage_mV, word, _, ttl = struct.unpack("<hHHB", content)
        self._last_seq = -1 if self.state == RUN else self._last_seq
        super()._on_drive(struct.pack("<hHHB", voltage_mV, word, self._owner, ttl))


SEEDS: dict[str, Row] = {
    "no DRIVE is accepted": (Deaf, "can", "drive-accepted"),
    "ttl_ms is not checked": (drive_seed(lambda _, v, w, s, __: (v, w, s, 50)), "can", "drive-refused"),
    "flags may contradict each other": (
        drive_seed(lambda _, v, w, s, t: (v, w & ~4 if w & 7 == 6 else w, s, t)), "can", "drive-refused",
    ),
    "arm overrules other flags": (
        drive_seed(lambda _, v, w, s, t: (v, w & ~6 if w & 1 else w, s, t)), "can", "arming-flags",
    ),
    "the session is not checked": (EverybodyDrives, "can", "drive-refused"),
    "broken rules count as gaps": (DropsCount, "can", "drive-refused"),
    "age is not checked": (drive_seed(_any_age), "can", "drive-age"),
    "age is taken of eight bits": (drive_seed(_eight_bits), "can", "drive-age"),
    "a period too much of age": (LongReach, "can", "drive-age"),
    "gaps are not counted": (RefusedCountsNothing, "can", "drive-age"),
    "a period too little of age": (ShortReach, "can", "drive-oldest"),
    "order is not checked": (AnyOrder, "can", "drive-order"),
    "STOP is obeyed in RUN only": (StopInRunOnly, "can", "stop"),
    "the last cause stays": (LastCauseStays, "can", "stop"),
    "FAULT is said once": (FaultOnce, "can", "stop"),
    "FAULT is said every 300 ms": (FaultSeldom, "can", "stop"),
    "clear needs no DRIVE without it": (ClearsWithoutEdge, "can", "clear"),
    "clear with a voltage": (ClearsWithVoltage, "can", "clear"),
    "nothing clears a fault": (NeverClears, "can", "clear"),
    "two sessions clear a fault": (ClearedByTwo, "can", "clear-session"),
    "release clears a fault": (ReleaseClears, "can", "clear-session"),
    "nine DRIVEs arm": (arming_seed(9), "can", "arming"),
    "five DRIVEs arm": (arming_seed(5), "can", "arming"),
    "what was counted before counts on": (ArmingCountsOn, "can", "arming"),
    "arming goes on over gaps": (ArmingWithGaps, "can", "arming-broken"),
    "arming with a voltage": (ArmingWithVoltage, "can", "arming-broken"),
    "silence in ARMING is a fault": (ArmingFaults, "can", "arming-silent"),
    "silence in ARMING is nothing": (ArmingForEver, "can", "arming-silent"),
    "clear does not disarm": (ClearDoesNotDisarm, "can", "disarm"),
    "the voltage stays after RUN": (VoltageStays, "can", "disarm"),
    "the voltage stays after STOP": (VoltageStays, "can", "stop-in-run"),
    "arm leads out of FAULT": (FaultLeadsToRun, "can", "stop-in-run"),
    "a second host's DRIVE is applied": (EverybodyDrives, "can", "second-host"),
}  # fmt: skip
