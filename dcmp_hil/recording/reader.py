"""Reading a recording back, whole or damaged anywhere: what is returned was checked, the rest is told."""

from __future__ import annotations

import json
import os
import stat
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from dcmp_hil.common.printable_text import readable
from dcmp_hil.config import Rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.deduplication import Gap, in_order
from dcmp_hil.recording.format_1 import event_of_format_1
from dcmp_hil.recording.mcap_records import Op, RecordError, counts_in, metadata_in
from dcmp_hil.recording.mcap_scanner import Damage, Scanner, attachment_of
from dcmp_hil.recording.messages import Messages
from dcmp_hil.recording.schema import ABOUT, CYCLES, END, EVENTS, FORMAT, FORMAT_1, RIG, RUN, event_from
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.signals import columns

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import IO

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.recording.mcap_scanner import Record
    from dcmp_hil.values import Event

_SENTENCES_MAX = 20  # sentences
_TEXT_CHARS_MAX = 10_000  # characters of what is said of a run
_UNCHECKED_NOTE = (
    "it has the older layout: what it says of its run (version, note, faults) is under no checksum, and "
    "whether an event is missing is known only where the file ended properly"
)


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
        Every cycle that is there and right, shape (n, len(FIELDS)), as it was in the ring.
    events
        What happened, in order.
    complete
        True only if everything was checked and nothing is missing.
    gaps
        Periods that are missing.
    damage
        What is wrong with the file, a sentence each; empty where nothing is.
    unchecked
        What this layout has no checksum for, a sentence each.
    """

    path: Path
    rig: Rig
    run: dict[str, str]
    rows: NDArray[np.float64]
    events: tuple[Event, ...]
    complete: bool
    gaps: tuple[Gap, ...] = ()
    damage: tuple[str, ...] = ()
    unchecked: tuple[str, ...] = ()

    @property
    def block(self) -> Block:
        """Return all periods as one block."""
        return Block(self.rows, self.rig.model.values())

    @property
    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Every signal of the table, shape (n,), by name with unit."""
        return columns(self.block)

    def blocks(self, rows: int = 4096) -> Iterator[Block]:
        """Yield the periods in blocks of so many rows at most."""
        model = self.rig.model.values()
        for first in range(0, len(self.rows), rows):
            yield Block(self.rows[first : first + rows], model)


def recording_in(path: Path) -> Path:
    """Return the recording that a path means: the file itself, or the one in a run's folder."""
    return path / "run.mcap" if path.is_dir() else path


def read_run(path: Path) -> RecordedRun:
    """Read a recording; nothing that it names is imported or opened.

    Raises
    ------
    ConfigError
        If there is no such file, it is no recording of this program, or of a newer version.
    """
    path = recording_in(path)
    try:
        with open(path, "rb", opener=_opened) as file:
            known = os.fstat(file.fileno())
            if not stat.S_ISREG(known.st_mode):
                raise ConfigError(f"{path}: it is no file. Name a run's folder, or its run.mcap.")
            return _read(path, file, known.st_size)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"{path}: {reason}. Runs keep run.mcap in runs/<time>-<rig>/.") from None
    except MemoryError:
        raise ConfigError(
            f"{path}: it needs more memory than there is. Read it on a computer with more."
        ) from None


def _opened(path: str, flags: int) -> int:
    """Open without waiting: a pipe has no other end."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _read(path: Path, file: IO[bytes], size: int) -> RecordedRun:
    found = _FileContents()
    scanner = Scanner(file, size)
    for piece in scanner:
        if isinstance(piece, Damage):
            found.damage.append(piece)
        else:
            found.take(piece, summary_checked=scanner.summary_checked is True)
    run = found.about(path)
    rig = _rig(path, found, run)
    older = run["format"] == FORMAT_1
    periods, events = found.totals()
    event_of = event_of_format_1 if older else event_from
    ordered = in_order(found.messages, found.began_ns, periods, events, event_of)
    damage = _told(found, scanner, (*found.faults, *found.messages.faults, *ordered.faults), ordered.gaps)
    unchecked = (_UNCHECKED_NOTE,) if older else ()
    complete = not damage and not unchecked and scanner.closed and scanner.data_checked is True
    if not complete and not damage and not unchecked:
        damage = ("it has no checksum over all of it: another program wrote it",)
    return RecordedRun(
        path, rig, run, ordered.rows, ordered.events, complete, ordered.gaps, damage, unchecked
    )


def _told(
    found: _FileContents, scanner: Scanner, faults: tuple[str, ...], gaps: tuple[Gap, ...]
) -> tuple[str, ...]:
    """Return what is wrong, a sentence each, the time spans first."""
    told = [str(gap) for gap in gaps]
    told += [f"bytes {one.at} to {one.end} are left out: {one.why}" for one in found.damage]
    told += faults
    if not found.damage:
        if scanner.data_checked is False:
            told.append("the checksum over all of it is wrong: something outside of the blocks was changed")
        if scanner.summary_checked is False:
            told.append("the checksum of its index is wrong")
        if not scanner.closed:
            told.append("it was cut off")
    more = len(told) - _SENTENCES_MAX
    return (*told[:_SENTENCES_MAX], f"and {more} more of the kind") if more > 0 else tuple(told)


def _rig(path: Path, found: _FileContents, run: dict[str, str]) -> Rig:
    """Return the rig, which finds its classes where the run did as long as both lie as they lay then."""
    table = found.attached(RIG)
    if not isinstance(table, dict):
        raise ConfigError(
            f"{path}: the rig in it is missing or damaged, and its columns cannot be told without. "
            "Use another copy of the file."
        )
    try:
        rig = Rig.model_validate(table)
    except ValidationError as error:
        raise ConfigError(
            f"{path}: its rig is not one of this version ({error.error_count()} keys differ)."
        ) from None
    except (RecursionError, ArithmeticError, MemoryError):
        raise ConfigError(f"{path}: its rig is none.") from None
    return rig.in_folder(path.parent / run["rig_folder"]) if "rig_folder" in run else rig


class _FileContents:
    """Contents of a recording's file, before they are put in order."""

    def __init__(self) -> None:
        self.messages = Messages()
        self.damage: list[Damage] = []
        self.faults: list[str] = []
        self.began_ns = 0
        self._attached: dict[str, bytes] = {}
        self._run: dict[str, str] | None = None
        self._said_counts: dict[int, int] | None = None  # of a summary that was not checked yet
        self._counts: dict[int, int] | None = None

    def take(self, record: Record, *, summary_checked: bool) -> None:
        """Process a record, in the order of the file; the footer says whether its summary was checked."""
        try:
            if record.opcode == Op.CHUNK:
                self.messages.take(record.content)
            elif record.opcode == Op.ATTACHMENT:
                self._attach(record)
            elif record.opcode == Op.METADATA:
                self._describe(record)
            elif record.opcode == Op.STATISTICS:
                self._said_counts = counts_in(record.content)
            elif record.opcode == Op.FOOTER:
                self._counts = self._counts or (self._said_counts if summary_checked else None)
            elif record.opcode == Op.MESSAGE:
                self._fault("messages outside of blocks are left out: no checksum covers them")
        except RecordError as error:
            self._fault(f"a record cannot be read: {error}")

    def attached(self, name: str) -> Any:
        """Return an attached document; None if there is none that can be read."""
        try:
            return json.loads(self._attached[name])
        except (KeyError, ValueError, RecursionError):
            return None

    def about(self, path: Path) -> dict[str, str]:
        """Return what is said of the run, from under a checksum where there is one.

        Raises
        ------
        ConfigError
            If nothing is, or a version is that this one does not read.
        """
        said = self.attached(ABOUT)
        if not isinstance(said, dict):
            said = self._run
            if said is not None and said.get("format") == FORMAT:
                self._fault("what it says of its run (version, note, faults) is left as it is, unchecked")
        if said is None and RIG in self._attached:
            self._fault("what it says of its run (version, note, faults) is lost")
            said = {"format": FORMAT_1}
        if said is None:
            raise ConfigError(f"{path}: this is no recording of dcmp-hil, or its very beginning is missing.")
        run = {
            readable(str(key))[:_TEXT_CHARS_MAX]: readable(str(text))[:_TEXT_CHARS_MAX]
            for key, text in said.items()
        }
        if run.get("format") not in {FORMAT, FORMAT_1}:
            raise ConfigError(
                f"{path}: a recording of format {run.get('format', 'unknown'):.20}; this version reads "
                f"{FORMAT}. Use dcmp-hil {run.get('version', 'of that time'):.40}."
            )
        return run

    def totals(self) -> tuple[int | None, int | None]:
        """Return how many periods and events there were; None where nothing that was checked says it."""
        end = self.attached(END)
        if isinstance(end, dict) and all(isinstance(end.get(key), int) for key in ("periods", "events")):
            return end["periods"], end["events"]
        if self._counts is not None:
            channels = self.messages.channel_of(CYCLES), self.messages.channel_of(EVENTS)
            periods, events = (self._counts.get(channel, 0) for channel in channels)
            return periods, events
        return None, None

    def _describe(self, record: Record) -> None:
        name, entries = metadata_in(record.content)
        if name == RUN and self._run is None:
            self._run = entries

    def _attach(self, record: Record) -> None:
        attachment = attachment_of(record)
        if attachment.name not in {ABOUT, RIG, END}:
            return
        self.began_ns = self.began_ns or attachment.log_time
        if attachment.log_time != self.began_ns:
            self._fault(f"{attachment.name} of another run is in it")
        elif self._attached.setdefault(attachment.name, attachment.data) != attachment.data:
            self._fault(f"two {attachment.name} in it differ; the first one counts")

    def _fault(self, sentence: str) -> None:
        if sentence not in self.faults:
            self.faults.append(sentence)
