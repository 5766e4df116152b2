"""A host for conformance checks, which measures time by the device's own ticks."""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING, TypeVar

from dcmp_hil.conformance.listener import Listener
from dcmp_hil.conformance.terms import NotJudgedError
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import (
    Drive,
    Health,
    Hello,
    Identity,
    Parameter,
    ParameterGet,
    ParameterSet,
    ParameterValue,
    State,
    Stop,
)
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.conformance.listener import Seen
    from dcmp_hil.wire.messages import Message

_Answer = TypeVar("_Answer", bound="Message")

ANSWER_TICKS = 200  # an answer takes no longer
SESSION_MAX = 0xFFFF


class Client(Listener):
    """A host that sends requests to one device; constructed like a Listener."""

    def after_fence(self, mark: int) -> list[Seen]:
        """Return the SAMPLEs since `mark`, once the device has had all that was sent, and two ticks."""
        self.get(Parameter.TICK)
        self.listen(2)
        return self.samples[mark:]

    def settled_state(self) -> int:
        """Return the state once the device has had all that was sent."""
        self.after_fence(len(self.samples))
        return self.state

    def send(self, message: Message) -> None:
        """Send a message."""
        self.line.send(pack(message, self.node))

    def send_spoilt(self, message: Message) -> None:
        """Send a message with a wrong crc8; on a serial line its crc16 is right."""
        number, data = pack(message, self.node)
        self.line.send((number, data[:-1] + bytes([data[-1] ^ 0x55])))

    def ask(
        self, question: Message, kind: type[_Answer], fits: Callable[[_Answer], bool] = lambda _: True
    ) -> _Answer | None:
        """Ask once; return the answer, None if none came within ANSWER_TICKS."""
        self.drain()
        at, first = len(self.heard), len(self.samples)
        self.send(question)
        while len(self.samples) < first + ANSWER_TICKS:
            self.listen_briefly()
            for message in self.heard[at:]:
                if isinstance(message, kind) and fits(message):
                    return message
            at = len(self.heard)
        return None

    def listen_briefly(self) -> None:
        """Wait for any message, until the device counts as silent."""
        before = len(self.heard)
        self.take(0.05)
        if len(self.heard) == before:
            self.listen()

    def hello(self, session: int = 0, wrong: int = 0) -> Identity | None:
        """Ask who is there, or to own the device; `wrong` spoils the protocol hash."""
        if session and session not in self.sessions:
            self.sessions.append(session)
        return self.ask(Hello(session, PROTOCOL_HASH ^ wrong), Identity)

    def own(self) -> int:
        """Own the device by a session of its own and return it.

        Raises
        ------
        NotJudgedError
            If the device does not give itself: `ownership` says more.
        """
        session = self.another_session()
        identity = self.hello(session)
        if identity is None or not identity.owned:
            raise NotJudgedError("the device gave no ownership")
        return session

    def another_session(self) -> int:
        """Return a session number that has not been used yet."""
        while (session := secrets.randbelow(SESSION_MAX) + 1) in self.sessions:
            pass
        return session

    def get(self, parameter: int) -> ParameterValue | None:
        """Read a parameter."""
        return self.ask(ParameterGet(parameter), ParameterValue, lambda value: value.id == parameter)

    def value(self, parameter: int) -> int:
        """Return the value of a parameter that every device has.

        Raises
        ------
        NotJudgedError
            If there is no answer: `parameters-read` says more.
        """
        found = self.get(parameter)
        if found is None:
            raise NotJudgedError(f"no answer to PARAMETER_GET {parameter}")
        return found.value

    def put(self, session: int, parameter: int, value: int) -> ParameterValue | None:
        """Set a parameter."""
        return self.ask(
            ParameterSet(session, parameter, value), ParameterValue, lambda answer: answer.id == parameter
        )

    def drive(
        self,
        session: int,
        voltage_mV: int = 0,
        *,
        arm: bool = False,
        clear: bool = False,
        release: bool = False,
        back: int = 0,
        ttl_ms: int = 50,
        spoilt: bool = False,
    ) -> None:
        """Send a DRIVE that answers the SAMPLE `back` ticks before the newest."""
        message = Drive(voltage_mV, (self.tick - back) % 8192, arm, clear, release, session, ttl_ms)
        (self.send_spoilt if spoilt else self.send)(message)

    def stop(self, reason: int = 0) -> None:
        """Send STOP."""
        self.send(Stop(reason))

    def synchronise(self) -> None:
        """Learn the whole tick and the period.

        Raises
        ------
        SampleTimeoutError
            If there is no device.
        """
        self.listen(2)
        found = self.get(Parameter.TICK)
        if found is not None:
            self.join(found.value)
        found = self.get(Parameter.PERIOD_US)
        if found is not None and found.value > 0:
            self.period_us = found.value

    def health(self) -> Health:
        """Return the next HEALTH.

        Raises
        ------
        NotJudgedError
            If none comes: `health` says more.
        """
        self.drain()
        at = len(self.heard)
        for _ in range(3 * self.periods(100)):
            self.listen()
            for message in self.heard[at:]:
                if isinstance(message, Health):
                    return message
            at = len(self.heard)
        raise NotJudgedError("no HEALTH came")

    def answer(self, ticks: int, session: int, voltage_mV: int = 0, *, arm: bool = True) -> list[Seen]:
        """Answer SAMPLEs until `ticks` have passed; return those that came."""
        first = len(self.samples)
        end = self.tick + ticks
        while self.tick < end:
            self.newest()
            self.drive(session, voltage_mV, arm=arm)
        return self.samples[first:]

    def arm(self, session: int) -> None:
        """Bring the device to RUN by answering each SAMPLE.

        Raises
        ------
        NotJudgedError
            If it does not come to RUN: `arming` says more.
        """
        for _ in range(4 * self.periods(500)):
            self.newest()
            if self.state == State.RUN:
                return
            if self.state == State.FAULT:
                break
            self.drive(session, arm=True)
        raise NotJudgedError("the device did not come to RUN")
