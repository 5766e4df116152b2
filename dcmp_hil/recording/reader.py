"""Reading a recording back, whole or cut off anywhere."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from mcap.records import Attachment, Footer, Message, Metadata
from mcap.stream_reader import StreamReader
from pydantic import ValidationError

from dcmp_hil.config import Rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.format_1 import event_of_format_1
from dcmp_hil.recording.layout import FORMAT, FORMAT_1, RIG, RUN, event_from, to_row
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.ring import FIELDS
from dcmp_hil.telemetry.signals import columns

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import IO

    from numpy.typing import NDArray

    from dcmp_hil.values import Event


@dataclass(frozen=True)
class RecordedRun:
    """A run, read back.

    Parameters
    ----------
    path
        The file.
    rig
        What was run.
    run
        What is known of the run: version, protocol, host, note.
    rows
        Every period, shape (n, len(FIELDS)), as it was in the ring.
    events
        What happened, in order.
    complete
        False where the file ends too soon; what is there is right all the same.
    """

    path: Path
    rig: Rig
    run: dict[str, str]
    rows: NDArray[np.float64]
    events: tuple[Event, ...]
    complete: bool

    @property
    def block(self) -> Block:
        """All periods as one block."""
        return Block(self.rows, self.rig.model.values())

    @property
    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Every signal of the table, shape (n,), by name with unit."""
        return columns(self.block)


def recording_in(path: Path) -> Path:
    """Return the recording that a path means: the file itself, or the one in a run's folder."""
    return path / "run.mcap" if path.is_dir() else path


def read_run(path: Path) -> RecordedRun:
    """Read a recording.

    Raises
    ------
    ConfigError
        If there is no such file, it is no recording of this program, or of a newer version.
    """
    path = recording_in(path)
    try:
        with path.open("rb") as file:
            return _read(path, file)
    except OSError as error:
        raise ConfigError(
            f"{path}: {error.strerror or error}. Runs keep run.mcap in runs/<time>-<rig>/."
        ) from None


def _read(path: Path, file: IO[bytes]) -> RecordedRun:
    found = _Found()
    for record in _records(file, found):
        if isinstance(record, Message):
            _take(path, found, record)
        elif isinstance(record, Metadata) and record.name == RUN:
            found.run = record.metadata
            if found.run.get("format") not in {FORMAT, FORMAT_1}:
                raise ConfigError(
                    f"{path}: a recording of format {found.run.get('format')}; this version reads {FORMAT}. "
                    f"Use dcmp-hil {found.run.get('version', 'of that time')}."
                )
        elif isinstance(record, Attachment) and record.name == RIG:
            found.rig = json.loads(record.data)
    if found.run is None or found.rig is None:
        raise ConfigError(f"{path}: this is no recording of dcmp-hil, or its very beginning is missing.")
    rig = _rig(path, found.run, found.rig)
    rows = np.array(found.rows) if found.rows else np.empty((0, len(FIELDS)))
    return RecordedRun(path, rig, found.run, rows, tuple(found.events), found.complete)


def _take(path: Path, found: _Found, message: Message) -> None:
    try:
        found.take(message)
    except ValueError as error:
        raise ConfigError(f"{path}: something in it cannot be read ({error}).") from None


def _rig(path: Path, run: dict[str, str], table: dict[str, Any]) -> Rig:
    """Return the rig, which finds its classes where the run did as long as both lie as they lay then."""
    try:
        rig = Rig.model_validate(table)
    except ValidationError as error:
        raise ConfigError(
            f"{path}: its rig is not one of this version ({error.error_count()} keys differ)."
        ) from None
    return rig.in_folder(path.parent / run["rig_folder"]) if "rig_folder" in run else rig


def _records(file: IO[bytes], found: _Found) -> Iterator[Any]:
    """Yield records until the file ends, properly or not."""
    try:
        for record in StreamReader(file).records:
            found.complete = isinstance(record, Footer)
            yield record
    except ConfigError:
        raise
    except Exception:  # noqa: BLE001 - a file that was cut, or ends in zeros, may be anything to its parsers
        found.complete = False


class _Found:
    """What was found so far."""

    def __init__(self) -> None:
        self.run: dict[str, str] | None = None
        self.rig: dict[str, Any] | None = None
        self.rows: list[NDArray[np.float64]] = []
        self.events: list[Event] = []
        self.complete = False

    def take(self, message: Message) -> None:
        """Take a period or an event: JSON begins with a brace, CDR with a zero.

        Raises
        ------
        ValueError
            If it is neither.
        """
        if message.data[:1] == b"{":
            known = event_of_format_1 if self.run and self.run.get("format") == FORMAT_1 else event_from
            self.events.append(known(json.loads(message.data)))
        else:
            self.rows.append(to_row(message.data))
