"""Messages of a device on a line, timed by its own ticks."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.conformance.terms import CAN
from dcmp_hil.errors import SampleTimeoutError
from dcmp_hil.wire.codec import CorruptFrameError, pack, unpack
from dcmp_hil.wire.messages import (
    Drive,
    FaultReport,
    Hello,
    ParameterGet,
    ParameterSet,
    SampleReport,
    Stop,
)
from dcmp_hil.wire.wrapping import unwrap

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.conformance.lines import CarrierLine
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame
    from dcmp_hil.wire.messages import Message

SILENCE_MAX_S = 2.0  # without a SAMPLE: the device is gone
_SAMPLE_AGE_MAX_US = 3000  # how old the SAMPLE may be that a DRIVE answers
_CLOCK_STEP_MAX_PERIODS = 0.3  # of a period, each period: by how much the two clocks may differ
_BURST_FRAMES_MAX = 512  # frames that are read without a look at the end


class StoppedError(Exception):
    """The person asked for the end."""


class Seen(NamedTuple):
    """A SAMPLE, and the whole tick that it is of."""

    tick: int
    sample: SampleReport
    fault: FaultReport | None  # that came just before it


class Listener:
    """Receives a device's messages and extends their ticks to whole numbers.

    Parameters
    ----------
    line
        Open.
    clock
        Bounds the waiting for a device that is silent; nothing is judged by it.
    node
        Of the device.
    stopping
        Whether the person asked for the end.
    """

    def __init__(
        self, line: CarrierLine, clock: Clock, node: int = 0, stopping: Callable[[], bool] = lambda: False
    ) -> None:
        self.line, self.clock, self.node = line, clock, node
        self._stopping = stopping
        self.heard: list[Message] = []
        self.samples: list[Seen] = []
        self.strange: list[str] = []  # frames of this node that no message is
        self.tick = 0  # of the newest SAMPLE; modulo 2^31 once `synchronise` was called
        self.period_us = 1000
        self.sessions: list[int] = []  # that asked for ownership, for the end to give back
        self.leaving = False  # the end is on its way: no request for it is looked at any more
        self.stalls = 0  # how often this host was too late to answer in time
        self._fault: FaultReport | None = None
        self._offset_us: float | None = None  # of this computer's clock, by the device's; the least of late

    def take(self, timeout: float) -> Message | None:
        """Return the next message of the device; None if none came within about `timeout` (s).

        Raises
        ------
        StoppedError
            If the end was asked for.
        """
        if self._stopping() and not self.leaving:
            raise StoppedError
        frame = self.line.receive(timeout)
        if frame is None or frame[0] & 0xF != self.node:
            return None
        message = self._understand(frame)
        if message is None:
            return None
        self.heard.append(message)
        if isinstance(message, SampleReport):
            self.tick = unwrap(self.tick, message.tick, 8) if self.samples else message.tick
            self.samples.append(Seen(self.tick, message, self._fault))
            self._fault = None
            self._notice_lateness()
        elif isinstance(message, FaultReport):
            self._fault = message
        return message

    def forget_lateness(self) -> None:
        """Judge lateness anew, after a pause that was meant."""
        self._offset_us = None

    def _notice_lateness(self) -> None:
        """Count a SAMPLE that was read too late to be answered; a clock that runs off is followed."""
        offset_us = self.clock.now_ns() / 1000 - self.tick * self.period_us
        if self._offset_us is None or offset_us < self._offset_us:
            self._offset_us = offset_us
        else:
            self._offset_us = min(offset_us, self._offset_us + _CLOCK_STEP_MAX_PERIODS * self.period_us)
        self.stalls += offset_us - self._offset_us > _SAMPLE_AGE_MAX_US

    def listen(self, ticks: int = 1) -> list[Seen]:
        """Return the next `ticks` SAMPLEs.

        Raises
        ------
        SampleTimeoutError
            If none came for SILENCE_MAX_S.
        """
        first = len(self.samples)
        deadline_ns = self.clock.now_ns() + int(1e9 * SILENCE_MAX_S)
        while len(self.samples) < first + ticks:
            before = len(self.samples)
            self.take(0.05)
            if len(self.samples) > before:
                deadline_ns = self.clock.now_ns() + int(1e9 * SILENCE_MAX_S)
            elif self.clock.now_ns() >= deadline_ns:
                raise SampleTimeoutError(
                    f"{self.line.name}: no SAMPLE of node {self.node} for {SILENCE_MAX_S:g} s. Look at "
                    "cable, baud rate, node and supply; `dcmp-hil ports` says what is there."
                )
        return self.samples[first:]

    def newest(self) -> Seen:
        """Wait for a SAMPLE and return the newest of those that wait."""
        self.listen()
        self.drain()
        return self.samples[-1]

    def drain(self) -> None:
        """Read every message that has arrived already."""
        for _ in range(_BURST_FRAMES_MAX):
            before = len(self.heard)
            if self.take(0.0) is None and len(self.heard) == before:
                return

    def join(self, tick: int) -> None:
        """Continue SAMPLE's tick from the parameter TICK, which was just read."""
        self.tick = unwrap(tick, self.samples[-1].sample.tick, 8)
        self._offset_us = None

    def mark(self) -> int:
        """Return a place in `samples` and leave nothing unread before it."""
        self.drain()
        return len(self.samples)

    @property
    def reach(self) -> int:
        """Return the age, in periods, that the SAMPLE of a DRIVE may have."""
        return -(-_SAMPLE_AGE_MAX_US // self.period_us)

    def periods(self, milliseconds: float) -> int:
        """Return a time in whole periods, rounded up."""
        return -int(-1000 * milliseconds // self.period_us)

    @property
    def state(self) -> int:
        """State in the newest SAMPLE."""
        return self.samples[-1].sample.state

    def wait_for(self, state: int, ticks: int) -> Seen | None:
        """Return the first SAMPLE with this state among the next `ticks`; None without one."""
        for _ in range(ticks):
            for seen in self.listen():
                if seen.sample.state == state:
                    return seen
        return None

    def _understand(self, frame: Frame) -> Message | None:
        number, data = frame
        shown = f"{number:03X}#{data.hex().upper()}"
        try:
            message = unpack(frame, self.node)
        except CorruptFrameError:
            self.strange.append(f"{shown}: its crc8 is wrong")
            return None
        if message is None:
            self.strange.append(f"{shown}: no message has this identifier and length")
        elif isinstance(message, Drive | Stop | Hello | ParameterGet | ParameterSet):
            if self.line.carrier != CAN:  # on a bus another host may be heard
                self.strange.append(f"{shown}: only a host sends this message")
            return None
        elif pack(message, self.node) != frame:
            self.strange.append(f"{shown}: bits without a name are not 0")
        return message
