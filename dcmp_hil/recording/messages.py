"""Contents of a block of a recording: cycles as rows of numbers, events, and their identity."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.recording.mcap_records import HEAD, KNOWN_OPCODES, Op, RecordError, channel_in, schema_in
from dcmp_hil.recording.schema import CYCLE_SCHEMA, CYCLES, EVENTS

if TYPE_CHECKING:
    from numpy.typing import NDArray


_MESSAGE = struct.Struct("<HIQQ")
_CDR_HEADER_BYTES = 4  # bytes in front of the numbers
_PERIOD = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
        ("header", "<u4"),
        ("row", "<f8", (len(FIELDS),)),
    ]
)
_PERIOD_LENGTH = _PERIOD.itemsize - HEAD.size
_CDR_HEADER = 0x00000100  # of CDR, little endian, as a number
RUN_TIME_MAX_S = 1e9
"""s; a device time beyond it has the beginning's time in the log."""
_EVENTS_MAX = 200_000
_EVENT_BYTES_MAX = 100_000  # bytes


class Messages:
    """Collects the messages of the blocks of one file, in the order of the file.

    Attributes
    ----------
    faults
        What was left out and why, each sentence once.
    events
        Sequence number, time of the log (ns) and text of each; the number is 0 in format 1.
    """

    def __init__(self) -> None:
        self._topics = {1: CYCLES, 2: EVENTS}  # as this program numbers them
        self._declared: dict[int, tuple[str, bytes]] = {}
        self._schemas: dict[int, bytes] = {}
        self._sequence = bytearray()
        self._log_time = bytearray()
        self._rows = bytearray()
        self.events: list[tuple[int, int, bytes]] = []
        self.faults: dict[str, None] = {}

    @property
    def sequence(self) -> NDArray[np.uint32]:
        """Number of each cycle from 1, shape (n,)."""
        return np.frombuffer(self._sequence, "<u4")

    @property
    def log_time(self) -> NDArray[np.uint64]:
        """Time of the log of each cycle, ns since 1970, shape (n,)."""
        return np.frombuffer(self._log_time, "<u8")

    @property
    def rows(self) -> NDArray[np.float64]:
        """Every cycle, shape (n, len(FIELDS)); this memory is the collector's own."""
        return np.frombuffer(self._rows, "<f8").reshape(-1, len(FIELDS))

    def channel_of(self, topic: str) -> int:
        """Return the number of a topic's channel; 0 if there is none."""
        return next((number for number, name in self._topics.items() if name == topic), 0)

    def take(self, data: bytes) -> None:
        """Process the records in a block."""
        at, end = 0, len(data)
        while at < end:
            if end - at < HEAD.size:
                self._fault("a block ends inside a record")
                return
            opcode, length = HEAD.unpack_from(data, at)
            start = at + HEAD.size
            if length > end - start or opcode not in KNOWN_OPCODES:
                self._fault("a block ends inside a record")
                return
            if opcode == Op.MESSAGE and length == _PERIOD_LENGTH and (count := self._periods(data, at)):
                at += count * _PERIOD.itemsize
                continue
            try:
                self._one(opcode, data[start : start + length])
            except RecordError as error:
                self._fault(f"a record in a block cannot be read: {error}")
            at = start + length

    def _periods(self, data: bytes, at: int) -> int:
        """Process the consecutive cycles from `at`; return their number."""
        found = np.frombuffer(data, _PERIOD, (len(data) - at) // _PERIOD.itemsize, at)
        same = (
            (found["opcode"] == Op.MESSAGE)
            & (found["length"] == _PERIOD_LENGTH)
            & (found["channel"] == self.channel_of(CYCLES))
            & (found["header"] == _CDR_HEADER)
        )
        count = len(found) if same.all() else int(np.argmin(same))
        found = found[:count]
        self._sequence += found["sequence"].tobytes()
        self._log_time += found["log_time"].tobytes()
        self._rows += found["row"].tobytes()
        return count

    def _one(self, opcode: int, content: bytes) -> None:
        if opcode == Op.SCHEMA:
            number, text = schema_in(content)
            self._schemas[number] = text
        elif opcode == Op.CHANNEL:
            self._channel(content)
        elif opcode == Op.MESSAGE:
            if len(content) < _MESSAGE.size:
                raise RecordError("it is too short")
            channel, sequence, log_time, _ = _MESSAGE.unpack_from(content)
            topic = self._topics.get(channel)
            if topic == EVENTS:
                self._event(sequence, log_time, content[_MESSAGE.size :])
            elif topic == CYCLES:
                self._fault("a period has not the numbers that a period has")

    def _channel(self, content: bytes) -> None:
        number, schema, topic, _ = channel_in(content)
        said = (topic, self._schemas.get(schema, b""))
        if number in self._declared:
            if self._declared[number] != said:
                self._topics.pop(number, None)
                self._fault("one channel is two things")
            return
        twice = any(topic == other for other, _ in self._declared.values())
        self._declared[number] = said
        self._topics.pop(number, None)
        if topic not in {CYCLES, EVENTS}:
            return
        if twice:
            self._fault(f"there are two channels {topic}")
        elif topic == CYCLES and said[1] != CYCLE_SCHEMA:
            self._topics = {one: name for one, name in self._topics.items() if name != topic}
            self._fault("its periods have other columns than those of this version")
        else:
            self._topics = {one: name for one, name in self._topics.items() if name != topic} | {
                number: topic
            }

    def _event(self, sequence: int, log_time: int, text: bytes) -> None:
        if len(self.events) >= _EVENTS_MAX:
            self._fault(f"it has more than {_EVENTS_MAX} events")
            return
        if len(text) > _EVENT_BYTES_MAX:
            self._fault("an event is longer than any is")
        else:
            self.events.append((sequence, log_time, text))

    def _fault(self, sentence: str) -> None:
        self.faults[sentence] = None


def log_times(times: NDArray[np.float64], began_ns: int) -> NDArray[np.uint64]:
    """Return the times of the log that belong to device times (s), ns since 1970, shape (n,)."""
    with np.errstate(invalid="ignore"):
        known = np.abs(times) < RUN_TIME_MAX_S
    offset = np.rint(np.where(known, times, 0.0) * 1e9).astype(np.int64)
    return (offset + began_ns).astype(np.uint64)
