"""Writing a run down as it goes: what was handed over is in the file, even if this process is killed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import CompressionType, Writer

from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import utc_now
from dcmp_hil.recording.chunk_indices import ChunkIndices
from dcmp_hil.recording.mcap_records import MAGIC
from dcmp_hil.recording.messages import log_times
from dcmp_hil.recording.schema import (
    ABOUT,
    CYCLES,
    END,
    EVENT_SCHEMA,
    EVENTS,
    FURTHER,
    LIBRARY,
    PROFILE,
    RIG,
    RUN,
    cycle_schema,
    event_to_bytes,
    to_bytes,
)
from dcmp_hil.recording.write_buffer import WriteBuffer

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path
    from typing import IO

    from dcmp_hil.recording.write_buffer import Piece
    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event

_CHUNK_DURATION_S, _ROW_BYTES = 0.03, 240  # what is not in a chunk yet is lost with the process
_CHUNK_BYTES_MIN = 2_000  # bytes of a chunk
_LOST_STRETCHES_MAX = 100  # stretches that the end names


class RecordingSink:
    """A sink that keeps every cycle and every event.

    A disk that is full is asked again with every block; what waits meanwhile is kept up to a bound, and
    what is dropped beyond it is told with its time span.

    Parameters
    ----------
    path
        The .mcap file.
    period
        s, nominal.
    run
        What the run is, in words.
    rig
        The rig, as JSON.
    open_file
        Makes the file.

    Attributes
    ----------
    interval
        s between two blocks: with the chunks' own 30 ms, what a killed process loses at most.
    warnings
        What is missing, or waits, a sentence each.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """

    interval = 0.05

    def __init__(
        self,
        path: Path,
        period: float,
        run: Mapping[str, str],
        rig: str,
        open_file: Callable[[Path], WriteBuffer] = WriteBuffer,
    ) -> None:
        self._path = path
        self._began_ns = int(utc_now().timestamp() * 1e9)  # of device time 0, near enough for a log
        self._period = self._event = 0  # numbers of the last ones
        self._dropped_told = 0
        self._cut_at = 0  # number of the last cycle in a piece
        self._t = self._cut_t = 0.0  # s, device time of the newest, and of the last in a piece
        self._attached = [(ABOUT, json.dumps(dict(run)).encode()), (RIG, rig.encode())]
        self._further: tuple[str, ...] | None = None  # not known yet
        self._cycles = self._events = 0  # numbers of the channels
        self.warnings: list[str] = []
        try:
            self._file = open_file(path)
            self._writer: Any = Writer(  # its methods have no types
                cast("IO[bytes]", self._file),  # it asks for no more than write, tell and flush
                chunk_size=max(_CHUNK_BYTES_MIN, round(_CHUNK_DURATION_S / period) * _ROW_BYTES),
                compression=CompressionType.ZSTD,
                enable_data_crcs=True,
            )
            self._writer.start(profile=PROFILE, library=LIBRARY)
            self._writer.add_metadata(RUN, dict(run))
            self._attach(self._attached)
            self._file.cut(0.0, 0.0, 1, 0)
            began, reason = self._file.put(), self._file.refused
        except OSError as error:
            began, reason = False, error.strerror or str(error)
        if not began:
            raise ConfigError(
                f"{path}: {reason}. Choose a folder that you may write in, with some space "
                "left, or use --no-record."
            )

    def begin(self, further: tuple[str, ...]) -> None:
        """Say what columns a cycle has, before the first of them and before any event.

        Parameters
        ----------
        further
            Names of those that not every run has. Without this call they are those of the first block, or
            none if an event comes before it.
        """
        if self._further is not None:
            return
        self._further = further
        if further:  # under a checksum of its own: the schema is in the first block alone
            self._attached.append((FURTHER, json.dumps(further).encode()))
            self._attach(self._attached[-1:])
        cycle = self._writer.register_schema("dcmp_hil/msg/Cycle", "ros2msg", cycle_schema(further))
        log = self._writer.register_schema("foxglove.Log", "jsonschema", EVENT_SCHEMA)
        self._cycles = self._writer.register_channel(CYCLES, "cdr", cycle)
        self._events = self._writer.register_channel(EVENTS, "json", log)
        # Its list of objects would take a megabyte a minute for as long as the run goes on.
        self._writer._Writer__chunk_indices = ChunkIndices(  # noqa: SLF001
            (self._cycles, self._events)
        )

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles.

        Raises
        ------
        RuntimeError
            If it has other columns than the ones before.
        """
        self.begin(block.further)
        if block.further != self._further:
            raise RuntimeError("A block has other columns than the recording.")
        times = block["t"]
        at_ns = log_times(times, self._began_ns).tolist()
        for t, data, at in zip(times.tolist(), to_bytes(block.rows), at_ns, strict=True):
            self._period += 1
            self._t = t
            self._writer.add_message(self._cycles, at, data, at, self._period)
            self._cut()
        self._put()

    def event(self, event: Event) -> None:
        """Process an event."""
        self.begin(())
        at = int(log_times(np.array([event.t]), self._began_ns)[0])
        self._event += 1
        self._writer.add_message(self._events, at, event_to_bytes(event, at), at, self._event)
        self._cut()
        self._put()

    def close(self) -> None:
        """Write what was said of the run once more, how much there was, and the index.

        Raises
        ------
        RuntimeError
            If the end of the run is not in the file.
        """
        self.begin(())
        self._writer.flush()
        self._cut()
        self._file.put()
        lost = [_span(piece) for piece in self._file.dropped]
        document = {
            "periods": self._period,
            "events": self._event,
            "missing": _joined(lost)[:_LOST_STRETCHES_MAX],
        }
        self._attach(self._attached)
        self._writer.add_attachment(
            self._began_ns, self._began_ns, END, "application/json", json.dumps(document).encode()
        )
        if self._file.dropped:
            self._end_without_index()
        else:
            self._writer.finish()
        self._file.cut(self._t, self._t, 1, 0)
        written = self._file.put()
        self._tell_dropped()
        self._file.close()
        if not written:
            raise RuntimeError(
                f"{self._path} is incomplete: {self._file.refused}. Its end is missing; free some space."
            )

    def _attach(self, documents: Sequence[tuple[str, bytes]]) -> None:
        for name, data in documents:
            self._writer.add_attachment(self._began_ns, self._began_ns, name, "application/json", data)

    def _end_without_index(self) -> None:
        """End the file as the format allows it where offsets are no longer known."""
        builder: Any = RecordBuilder()
        DataEnd(0).write(builder)
        Footer(0, 0, 0).write(builder)
        self._file.write(builder.end() + MAGIC)

    def _cut(self) -> None:
        """End a piece where the writer has written a block."""
        if self._file.cut(self._cut_t, self._t, self._cut_at + 1, self._period):
            self._cut_at, self._cut_t = self._period, self._t

    def _put(self) -> None:
        """Write the bytes that wait; warn if the disk became full, or takes data again."""
        waited = self._file.refused
        written = self._file.put()
        if not written and not waited:
            self.warnings.append(
                f"{self._path} waits: {self._file.refused}. Free some space: what is recorded meanwhile is "
                f"written then, up to {self._file.room / 2**20:.0f} MiB of it. The run goes on."
            )
        elif written and waited and not self._tell_dropped():
            self.warnings.append(f"{self._path} goes on, and nothing is missing.")

    def _tell_dropped(self) -> bool:
        """Report blocks dropped since the last call; return whether there were any."""
        new = _joined([_span(piece) for piece in self._file.dropped[self._dropped_told :]])
        self._dropped_told = len(self._file.dropped)
        for start, stop, periods in new:
            self.warnings.append(
                f"{self._path} misses {periods} periods, device time {start:.6g} s to {stop:.6g} s: the disk "
                "was full."
            )
        return bool(new)


def _span(piece: Piece) -> tuple[float, float, int]:
    return piece.start, piece.stop, piece.last - piece.first + 1


def _joined(spans: list[tuple[float, float, int]]) -> list[tuple[float, float, int]]:
    """Merge consecutive stretches."""
    joined: list[tuple[float, float, int]] = []
    for start, stop, periods in spans:
        if joined and joined[-1][1] == start:
            joined[-1] = (joined[-1][0], stop, joined[-1][2] + periods)
        else:
            joined.append((start, stop, periods))
    return joined
