"""Contents of a block of a recording: cycles as rows of numbers, events, and their identity."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.recording.mcap_records import HEAD, KNOWN_OPCODES, Op, RecordError, channel_in, schema_in
from dcmp_hil.recording.schema import CYCLES, EVENTS, further_in
from dcmp_hil.telemetry.further_columns import FURTHER_MAX

if TYPE_CHECKING:
    from numpy.typing import NDArray


_MESSAGE = struct.Struct("<HIQQ")
_NUMBER_BYTES = 8
_BEFORE_ROW: list[tuple[str, str]] = [
    *(("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<u8")),
    *(("publish_time", "<u8"), ("header", "<u4")),
]
_BEFORE_ROW_BYTES = np.dtype(_BEFORE_ROW).itemsize
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
    further
        Names of the columns behind `FIELDS`; None where the block with the schema is not there.
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
        self.further: tuple[str, ...] | None = None
        self._period = np.dtype([*_BEFORE_ROW, ("row", "<f8", (len(FIELDS),))])
        self._width_known = False  # by a schema, or by the first cycle of a file that lost it

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
        """Every cycle, shape (n, len(FIELDS) or more); this memory is the collector's own."""
        return np.frombuffer(self._rows, "<f8").reshape(-1, self._width)

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
            if opcode == Op.MESSAGE and (count := self._periods(data, at, length)):
                at += count * self._period.itemsize
                continue
            try:
                self._one(opcode, data[start : start + length])
            except RecordError as error:
                self._fault(f"a record in a block cannot be read: {error}")
            at = start + length

    def _periods(self, data: bytes, at: int, length: int) -> int:
        """Process the consecutive cycles from `at`, the first of that length; return their number."""
        period = self._period_of(data, at, length)
        if period.itemsize != HEAD.size + length:
            return 0
        found = np.frombuffer(data, period, (len(data) - at) // period.itemsize, at)
        same = (
            (found["opcode"] == Op.MESSAGE)
            & (found["length"] == length)
            & (found["channel"] == self.channel_of(CYCLES))
            & (found["header"] == _CDR_HEADER)
        )
        count = len(found) if same.all() else int(np.argmin(same))
        found = found[:count]
        self._sequence += found["sequence"].tobytes()
        self._log_time += found["log_time"].tobytes()
        self._rows += found["row"].tobytes()
        return count

    @property
    def _width(self) -> int:
        """Numbers of a cycle."""
        return int(self._period["row"].shape[0])

    def _period_of(self, data: bytes, at: int, length: int) -> np.dtype[np.void]:
        """Return the layout of a cycle; where its schema is lost, the first cycle says how long one is."""
        if not self._width_known and length >= _MESSAGE.size:
            (channel,) = struct.unpack_from("<H", data, at + HEAD.size)
            numbers, rest = divmod(HEAD.size + length - _BEFORE_ROW_BYTES, _NUMBER_BYTES)
            if channel == self.channel_of(CYCLES) and not rest:
                self._declare(numbers)
        return self._period

    def _declare(self, width: int) -> bool:
        """Take the number of columns, once; return whether it is the same as before."""
        if not self._width_known and len(FIELDS) <= width <= len(FIELDS) + FURTHER_MAX:
            self._width_known = True
            self._period = np.dtype([*_BEFORE_ROW, ("row", "<f8", (width,))])
        return width == self._width

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
        elif topic == CYCLES and not self._columns(said[1]):
            self._topics = {one: name for one, name in self._topics.items() if name != topic}
            self._fault("its periods have other columns than those of this version")
        else:
            self._topics = {one: name for one, name in self._topics.items() if name != topic} | {
                number: topic
            }

    def _columns(self, schema: bytes) -> bool:
        """Take the columns of the cycles; return whether this version knows them."""
        further = further_in(schema)
        if further is None or not self._declare(len(FIELDS) + len(further)):
            return False
        self.further = further
        return True

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
