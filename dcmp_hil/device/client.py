"""Asking a device and waiting for its answer: what handshake, disarm and `ports` have in common."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from dcmp_hil.device.node_uniqueness import NodeUniqueness
from dcmp_hil.wire.codec import CorruptFrameError, has_wrong_length, pack, unpack
from dcmp_hil.wire.messages import (
    FaultReport,
    Health,
    Identity,
    Parameter,
    ParameterValue,
    SampleReport,
)
from dcmp_hil.wire.wrapping import unwrap

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.device.links.base import Link
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message

_Answer = TypeVar("_Answer")

SKIPPED_FRAMES_MAX = 512  # frames that are skipped for a newer one; a peer that floods is no reason to stay
QUESTION_PERIOD_S = 0.05  # s, after which a question is asked again
ANSWER_TIMEOUT_S = 0.5  # s, for an answer in all
_SLOW_ANSWER_TIMEOUT_S = 0.5  # s: a slow line may bring the first answer only now
_ANSWER_DELAY_MAX_S = 1.0  # s: no answer comes later than that
SINGLE_ANSWER_TIMEOUT_S = 0.4  # s, for the answer to a question that is asked once


class _Owed(NamedTuple):
    """Answers that are still to come to a question that was asked more than once."""

    answers: int
    until_ns: int


class DeviceClient:
    """The host's side of a request and answer exchange with one device.

    Answers carry no number. A question of a kind is asked again only when the answers to those before have
    come, or can come no more: no answer is taken for that to another question.

    Parameters
    ----------
    link
        Open.
    clock
        Times the waiting.
    node
        Of the device.
    tick
        Of the newest SAMPLE, as far as it is known: periods since the device's boot.
    """

    def __init__(self, link: Link, clock: Clock, node: int, tick: int = 0) -> None:
        self._link, self._clock, self._node = link, clock, node
        self.sample: SampleReport | None = None  # the newest
        self.tick = tick  # of it; whole once PARAMETER_VALUE(TICK) was heard
        self.fault = 0  # code of the last fault heard of
        self.fault_detail = 0  # of it
        self.health: Health | None = None  # the newest
        self._first_health: Health | None = None
        self.heard: Counter[str] = Counter()  # messages of this device, by kind
        self.nodes: set[int] = set()  # others that were heard
        self.corrupt = 0  # frames whose length or crc8 was wrong
        self.uniqueness = NodeUniqueness()
        self._owed: dict[object, _Owed] = {}

    @property
    def damaged_there(self) -> int:
        """By how much the device's count of damaged frames grew, as far as it told."""
        return (
            self.health.crc_errors - self._first_health.crc_errors
            if self.health and self._first_health
            else 0
        )

    def send(self, message: Message) -> None:
        """Send a message."""
        self._link.send(pack(message, self._node))

    def receive(self, timeout: float) -> Message | None:
        """Return the next message of this device; None after `timeout` (s)."""
        deadline_ns = self._clock.now_ns() + int(1e9 * timeout)
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            frame = self._link.receive(1e-9 * left_ns)
            message = None if frame is None else self._understand(frame)
            if message is not None:
                return message
        return None

    def receive_any(self, timeout: float) -> tuple[int, Message] | None:
        """Return node and message of the next frame of any device or host; None after `timeout` (s)."""
        frame = self._link.receive(timeout)
        if frame is None:
            return None
        number, _ = frame
        node = number & 0xF
        try:
            message = unpack(frame, node)
        except CorruptFrameError:
            self.corrupt += 1
            return None
        return None if message is None else (node, message)

    def listen(self, seconds: float) -> None:
        """Read and sort every message that arrives within `seconds`."""
        self._listen_until(self._clock.now_ns() + int(1e9 * seconds))

    def receive_sample(self, timeout: float) -> SampleReport | None:
        """Return the next SAMPLE, the newest where several are waiting; None after `timeout` (s)."""
        sample = self._until(timeout, SampleReport, lambda _: True)
        for _ in range(SKIPPED_FRAMES_MAX):
            frame = self._link.receive(0.0)
            if frame is None:
                break
            message = self._understand(frame)
            sample = message if isinstance(message, SampleReport) else sample
        return sample

    def request(
        self, question: Message, answer: type[_Answer], fits: Callable[[_Answer], bool] = lambda _: True
    ) -> _Answer | None:
        """Ask, and ask again, until an answer of that type fits; None if none came in time."""
        key = _key_of_answer(question)
        self._await_owed(key)
        for _ in range(round(ANSWER_TIMEOUT_S / QUESTION_PERIOD_S)):
            self._ask_once(question, key)
            found = self._until(QUESTION_PERIOD_S, answer, fits)
            if found is not None:
                break
        else:
            found = self._until(_SLOW_ANSWER_TIMEOUT_S, answer, fits)
        self._let_owed_come(key, answered=found is not None)
        return found

    def time_answer(
        self, question: Message, answer: type[_Answer], fits: Callable[[_Answer], bool] = lambda _: True
    ) -> float | None:
        """Ask once; return how long the answer took, s, or None if none came within 0.4 s."""
        key = _key_of_answer(question)
        self._await_owed(key)
        began_ns = self._clock.now_ns()
        self._ask_once(question, key)
        found = self._until(SINGLE_ANSWER_TIMEOUT_S, answer, fits)
        self._let_owed_come(key, answered=found is not None)
        return None if found is None else 1e-9 * (self._clock.now_ns() - began_ns)

    def _ask_once(self, question: Message, key: object) -> None:
        owed = self._owed.get(key, _Owed(0, 0))
        self._owed[key] = owed._replace(answers=owed.answers + 1)
        self.send(question)

    def _await_owed(self, key: object) -> None:
        """Receive late answers to earlier requests of the same kind."""
        while (owed := self._owed.get(key)) is not None:
            left_ns = owed.until_ns - self._clock.now_ns()
            if owed.answers <= 0 or left_ns <= 0:
                break
            self.receive(1e-9 * left_ns)
        self._owed.pop(key, None)

    def _let_owed_come(self, key: object, *, answered: bool) -> None:
        """Answers follow one another as their questions did, 50 ms apart; the first may be long under way."""
        owed = self._owed.pop(key, None)
        if owed is not None and owed.answers > 0:
            longest = QUESTION_PERIOD_S * (owed.answers + 1) if answered else _ANSWER_DELAY_MAX_S
            until_ns = self._clock.now_ns() + int(1e9 * longest)
            self._owed[key] = _Owed(owed.answers, until_ns)

    def _listen_until(self, deadline_ns: int) -> None:
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            self.receive(1e-9 * left_ns)

    def _understand(self, frame: Frame) -> Message | None:
        try:
            message = unpack(frame, self._node)
        except CorruptFrameError:
            self.corrupt += 1
            return None
        if message is None:
            self._note_foreign(frame)
        else:
            self.heard[type(message).__name__] += 1
            self._note(message)
        return message

    def _note(self, message: Message) -> None:
        """Store tick, fault or health from a message, and note which request it answers."""
        if isinstance(message, SampleReport):
            self.sample, self.tick = message, unwrap(self.tick, message.tick, 8)
            self.uniqueness.add(message)
        elif isinstance(message, FaultReport):
            self.fault, self.fault_detail = message.code, message.detail
        elif isinstance(message, Health):
            self.health = message
            self._first_health = self._first_health or message
        elif isinstance(message, ParameterValue):
            if message.id == Parameter.TICK:
                self.tick = message.value
            self._note_answer(ParameterValue, message.id)
        elif isinstance(message, Identity):
            self._note_answer(Identity)

    def _note_answer(self, *key: object) -> None:
        owed = self._owed.get(key)
        if owed is not None:
            self._owed[key] = owed._replace(answers=owed.answers - 1)

    def _note_foreign(self, frame: Frame) -> None:
        number, _ = frame
        if has_wrong_length(frame, self._node):
            self.corrupt += 1
        elif number & 0xF != self._node:
            self.nodes.add(number & 0xF)

    def _until(self, timeout: float, kind: type[_Answer], fits: Callable[[_Answer], bool]) -> _Answer | None:
        deadline_ns = self._clock.now_ns() + int(1e9 * timeout)
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            message = self.receive(1e-9 * left_ns)
            if isinstance(message, kind) and fits(message):
                return message
        return None


def _key_of_answer(question: Message) -> tuple[object, ...]:
    """Return what an answer to a question has in common with it."""
    parameter = getattr(question, "id", None)
    return (Identity,) if parameter is None else (ParameterValue, parameter)
