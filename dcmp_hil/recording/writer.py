"""Writing a run down as it goes: what was handed over is in the file, whatever happens to this process."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from mcap.writer import CompressionType, Writer

from dcmp_hil.clock import utc_now
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.layout import (
    CYCLE_SCHEMA,
    CYCLES,
    EVENT_SCHEMA,
    EVENTS,
    LIBRARY,
    PROFILE,
    RIG,
    RUN,
    event_to_bytes,
    to_bytes,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event

_CHUNK_S, _ROW_BYTES = 0.03, 240  # what is not in a chunk yet is lost with the process
_LEAST = 2_000  # bytes of a chunk
_LONGEST = 1e9  # s


class Recording:
    """A sink that keeps every period and every event.

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

    Attributes
    ----------
    interval
        s between two blocks: with the chunks' own 30 ms, what a killed process loses at most.

    Raises
    ------
    ConfigError
        If the file cannot be written.
    """

    interval = 0.05

    def __init__(self, path: Path, period: float, run: Mapping[str, str], rig: str) -> None:
        self._path = path
        self._began_ns = int(utc_now().timestamp() * 1e9)  # of device time 0, near enough for a log
        self._sequence = 0
        try:
            self._file = path.open("wb")
            self._writer = Writer(
                self._file,
                chunk_size=max(_LEAST, round(_CHUNK_S / period) * _ROW_BYTES),
                compression=CompressionType.ZSTD,
            )
            self._writer.start(profile=PROFILE, library=LIBRARY)
            self._writer.add_metadata(RUN, dict(run))
            self._writer.add_attachment(self._began_ns, self._began_ns, RIG, "application/json", rig.encode())
            cycle = self._writer.register_schema("dcmp_hil/msg/Cycle", "ros2msg", CYCLE_SCHEMA)
            log = self._writer.register_schema("foxglove.Log", "jsonschema", EVENT_SCHEMA)
            self._cycles = self._writer.register_channel(CYCLES, "cdr", cycle)
            self._events = self._writer.register_channel(EVENTS, "json", log)
            self._file.flush()
        except OSError as error:
            raise ConfigError(
                f"{path}: {error.strerror or error}. Choose a folder that you may write in, with some space "
                "left, or use --no-record."
            ) from None

    def block(self, block: Block) -> None:
        """Take consecutive periods."""
        times = self._at(block["t"].tolist())
        with self._told_of():
            for data, at_ns in zip(to_bytes(block.rows), times, strict=True):
                self._sequence += 1
                self._writer.add_message(self._cycles, at_ns, data, at_ns, self._sequence)
            self._file.flush()

    def event(self, event: Event) -> None:
        """Take an event."""
        (at_ns,) = self._at([event.t])
        with self._told_of():
            self._writer.add_message(self._events, at_ns, event_to_bytes(event, at_ns), at_ns)
            self._file.flush()

    def close(self) -> None:
        """Write the index; a file without one is read as well."""
        with self._told_of():
            finish: Callable[[], None] = self._writer.finish
            finish()
            self._file.close()

    def _at(self, times: list[float]) -> list[int]:
        """Return instants since 1970, ns; a time that is no number is that of the beginning."""
        return [self._began_ns + (round(t * 1e9) if abs(t) < _LONGEST else 0) for t in times]

    @contextmanager
    def _told_of(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise RuntimeError(
                f"{self._path} is incomplete: {error.strerror or error}. Free some space; the run goes on."
            ) from None
