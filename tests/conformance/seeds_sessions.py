"""Errors of sessions and parameters: sections 5 and 9."""
# ruff: noqa: SLF001 - an error is sown by overriding what the device does inside

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from tests.conformance.seed import Seed
from tests.contract import reference_wire as wire
from tests.contract.reference_device import FIRMWARE_VERSION, HASH
from tests.contract.reference_wire import ARMING, RUN

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.conformance.seed import Row


def identity_seed(change: Callable[[int, int, bytes], bytes]) -> type[Seed]:
    class Answers(Seed):
        def _on_hello(self, content: bytes) -> None:
            super()._on_hello(content)
            number, said = self._outbox.answers[-1]
            session, _ = struct.unpack("<HI", content)
            self._outbox.answers[-1] = number, change(session, self._owner, said)

    return Answers


class TakesOver(Seed):
    def _on_hello(self, content: bytes) -> None:
        if struct.unpack("<HI", content)[0]:
            self._owner = 0
        super()._on_hello(content)


class OwnsDespiteHash(Seed):
    def _on_hello(self, content: bytes) -> None:
        session, theirs = struct.unpack("<HI", content)
        super()._on_hello(struct.pack("<HI", session, HASH) if session else content)
        number, said = self._outbox.answers[-1]
        if theirs != HASH:
            self._outbox.answers[-1] = number, said[:6] + bytes([said[6] | 4])


class BeginsAnew(Seed):
    def _on_hello(self, content: bytes) -> None:
        session, theirs = struct.unpack("<HI", content)
        if session and session == self._owner and theirs == HASH:
            self._owner = 0
        super()._on_hello(content)


class OrderBeginsAnew(Seed):
    def _on_hello(self, content: bytes) -> None:
        if struct.unpack("<HI", content)[0] == self._owner:
            self._last_seq = -1
        super()._on_hello(content)


class OneHelloAPeriod(Seed):
    hello_at = -1

    def _on_hello(self, content: bytes) -> None:
        if self.hello_at != self._periods:
            super()._on_hello(content)
        self.hello_at = self._periods


class NoRelease(Seed):
    def _on_drive(self, content: bytes) -> None:
        if not content[2] & 4:
            super()._on_drive(content)


def lease_seed(us: int) -> type[Seed]:
    class Lease(Seed):
        def _pass(self, passed_us: int) -> None:
            self.now_us += passed_us
            if self.state not in {ARMING, RUN} and self.now_us - self._heard_us >= us:
                self._begin_session(0)

    return Lease


class QuestionsRenew(Seed):
    def _on_hello(self, content: bytes) -> None:
        self._heard_us = self.now_us
        super()._on_hello(content)


class WrongHashRenews(Seed):
    def _on_hello(self, content: bytes) -> None:
        if struct.unpack("<HI", content)[0] == self._owner:
            self._heard_us = self.now_us
        super()._on_hello(content)


class SetsDoNotRenew(Seed):
    def _on_set(self, content: bytes) -> None:
        heard = self._heard_us
        super()._on_set(content)
        self._heard_us = heard


class ParametersStay(Seed):
    def sow(self) -> None:
        self._parameters.restore = lambda: None  # type: ignore[method-assign]


class OneParameterStays(Seed):
    def sow(self) -> None:
        usual = self._parameters.restore

        def restore() -> None:
            kept = self._set[wire.SLEW]
            usual()
            self._set[wire.SLEW] = kept

        self._parameters.restore = restore  # type: ignore[method-assign]


class ParametersStayForANext(Seed):
    """What the device did before: they are as built when the next session comes, not before."""

    def sow(self) -> None:
        self._usual = self._parameters.restore
        self._parameters.restore = lambda: None  # type: ignore[method-assign]

    def _on_hello(self, content: bytes) -> None:
        owner = self._owner
        super()._on_hello(content)
        if self._owner != owner:
            self._usual()


def change_seed(change: Callable[[dict[str, Any]], int | None]) -> type[Seed]:
    """Return a device whose PARAMETER_SET answers otherwise: None goes on as usual."""

    class Changes(Seed):
        def sow(self) -> None:
            usual = self._parameters.change

            def changed(id_: int, value: int, *, idle: bool, owner: bool) -> int:
                asked: dict[str, Any] = {
                    "device": self,
                    "id": id_,
                    "value": value,
                    "idle": idle,
                    "owner": owner,
                }
                other = change(asked)
                if other is not None:
                    return other
                return usual(id_, asked["value"], idle=asked["idle"], owner=asked["owner"])

            self._parameters.change = changed  # type: ignore[method-assign]

    return Changes


def _any_parameter(asked: dict[str, Any]) -> int | None:
    if asked["id"] != wire.PERIOD_US:
        return None
    asked["device"]._set[wire.PERIOD_US] = asked["value"]
    return wire.OK


def _beyond(asked: dict[str, Any]) -> int | None:
    if asked["id"] != wire.SPEED_LIMIT or asked["value"] <= 0:
        return None
    asked["device"]._set[wire.SPEED_LIMIT] = asked["value"]
    return wire.OK


def _longer_watchdog(asked: dict[str, Any]) -> int | None:
    if asked["id"] != wire.WATCHDOG or not 5 <= asked["value"] <= 50:
        return None
    asked["device"]._set[wire.WATCHDOG] = asked["value"]
    return wire.OK


def _always(name: str) -> Callable[[dict[str, Any]], int | None]:
    def change(asked: dict[str, Any]) -> int | None:
        asked[name] = True
        return None

    return change


def _reason_order(asked: dict[str, Any]) -> int | None:
    return None if asked["owner"] else wire.NOT_OWNER


class ParameterMissing(Seed):
    def sow(self) -> None:
        del self._set[wire.LAST_FAULT_DETAIL]


class UnknownIsZero(Seed):
    def sow(self) -> None:
        self._set[100] = 0


def _hash(_session: int, _owner: int, said: bytes) -> bytes:
    return struct.pack("<IH", HASH ^ 0x1000, FIRMWARE_VERSION) + said[6:]


def _no_mismatch(_session: int, _owner: int, said: bytes) -> bytes:
    return said[:6] + bytes([said[6] & 3])


def _never_busy(_session: int, _owner: int, said: bytes) -> bytes:
    return said[:6] + bytes([said[6] & 6])


SEEDS: dict[str, Row] = {
    "another protocol hash": (identity_seed(_hash), "can", "identity"),
    "mismatch is never said": (identity_seed(_no_mismatch), "can", "identity"),
    "a wrong hash owns": (OwnsDespiteHash, "can", "identity"),
    "busy is never said": (identity_seed(_never_busy), "can", "ownership"),
    "a second host takes over": (TakesOver, "can", "ownership"),
    "a HELLO of the owner restores the parameters": (BeginsAnew, "can", "repeated-hello"),
    "a HELLO of the owner begins the order anew": (OrderBeginsAnew, "can", "repeated-hello"),
    "one HELLO a period is answered": (OneHelloAPeriod, "can", "two-hellos"),
    "release is not obeyed": (NoRelease, "can", "release"),
    "ownership ends after 300 ms": (lease_seed(300_000), "can", "lease"),
    "ownership never ends": (lease_seed(10**12), "can", "lease"),
    "questions of others renew ownership": (QuestionsRenew, "can", "lease"),
    "a HELLO with another hash renews ownership": (WrongHashRenews, "can", "lease"),
    "PARAMETER_SET does not renew ownership": (SetsDoNotRenew, "can", "lease"),
    "parameters outlast their owner": (ParametersStay, "can", "as-built"),
    "parameters last until the next owner": (ParametersStayForANext, "can", "as-built"),
    "one parameter outlasts its owner": (OneParameterStays, "can", "as-built"),
    "a parameter is missing": (ParameterMissing, "can", "parameters-read"),
    "an unknown parameter is 0, OK": (UnknownIsZero, "can", "parameters-unknown"),
    "the period can be set": (change_seed(_any_parameter), "can", "parameters-read-only"),
    "a limit can be raised": (change_seed(_beyond), "can", "parameters-range"),
    "the watchdog's time can be raised": (change_seed(_longer_watchdog), "can", "parameters-range"),
    "every session may set parameters": (change_seed(_always("owner")), "can", "parameters-owner"),
    "the wrong reason is answered": (change_seed(_reason_order), "can", "parameters-owner"),
    "parameters may be set in FAULT": (change_seed(_always("idle")), "can", "parameters-idle"),
    "parameters may be set in RUN": (change_seed(_always("idle")), "can", "parameters-in-run"),
}  # fmt: skip
