"""Asking a device and waiting for its answer: what handshake, goodbye and `ports` have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from dcmp_hil.wire.codec import CorruptFrameError, pack, unpack
from dcmp_hil.wire.counters import nearest
from dcmp_hil.wire.messages import FaultReport, Health, Parameter, ParameterValue, SampleReport

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.backends.link import Link
    from dcmp_hil.clock import Clock
    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message

_Answer = TypeVar("_Answer")

MOST_WAITING = 512  # frames that are skipped for a newer one; a peer that floods is no reason to stay
REPEAT = 0.05  # s, after which a question is asked again
PATIENCE = 0.5  # s, for an answer in all


class Caller:
    """One side of a conversation with one device.

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
        self.health: Health | None = None  # the newest
        self.foreign = 0  # frames that are not this device's
        self.corrupt = 0  # frames whose crc8 was wrong

    def say(self, message: Message) -> None:
        """Send a message."""
        self._link.send(pack(message, self._node))

    def hear(self, timeout: float) -> Message | None:
        """Return the next message of this device; None after `timeout` (s)."""
        deadline_ns = self._clock.now_ns() + int(1e9 * timeout)
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            frame = self._link.receive(1e-9 * left_ns)
            message = None if frame is None else self._understand(frame)
            if message is not None:
                return message
        return None

    def overhear(self, timeout: float) -> tuple[int, Message] | None:
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
        """Hear whatever comes for so long."""
        deadline_ns = self._clock.now_ns() + int(1e9 * seconds)
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            self.hear(1e-9 * left_ns)

    def hear_sample(self, timeout: float) -> SampleReport | None:
        """Return the next SAMPLE, the newest where several are waiting; None after `timeout` (s)."""
        sample = self._until(timeout, SampleReport, lambda _: True)
        for _ in range(MOST_WAITING):
            frame = self._link.receive(0.0)
            if frame is None:
                break
            message = self._understand(frame)
            sample = message if isinstance(message, SampleReport) else sample
        return sample

    def ask(
        self, question: Message, answer: type[_Answer], fits: Callable[[_Answer], bool] = lambda _: True
    ) -> _Answer | None:
        """Ask, and ask again, until an answer of that type fits; None if none came in time."""
        for _ in range(round(PATIENCE / REPEAT)):
            self.say(question)
            found = self._until(REPEAT, answer, fits)
            if found is not None:
                return found
        return None

    def _understand(self, frame: Frame) -> Message | None:
        try:
            message = unpack(frame, self._node)
        except CorruptFrameError:
            self.corrupt += 1
            return None
        if message is None:
            self.foreign += 1
        elif isinstance(message, SampleReport):
            self.sample, self.tick = message, nearest(self.tick, message.tick, 8)
        elif isinstance(message, FaultReport):
            self.fault = message.code
        elif isinstance(message, Health):
            self.health = message
        elif isinstance(message, ParameterValue) and message.id == Parameter.TICK:
            self.tick = message.value
        return message

    def _until(self, timeout: float, kind: type[_Answer], fits: Callable[[_Answer], bool]) -> _Answer | None:
        deadline_ns = self._clock.now_ns() + int(1e9 * timeout)
        while (left_ns := deadline_ns - self._clock.now_ns()) > 0:
            message = self.hear(1e-9 * left_ns)
            if isinstance(message, kind) and fits(message):
                return message
        return None
