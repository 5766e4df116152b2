"""Reading a recording back, whole or damaged anywhere: what is returned was checked, the rest is told."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pydantic import ValidationError

from dcmp_hil.config import Rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.recording.deduplication import Gap, in_order
from dcmp_hil.recording.file_contents import FileContents
from dcmp_hil.recording.format_1 import event_of_format_1
from dcmp_hil.recording.mcap_scanner import Damage, Scanner
from dcmp_hil.recording.schema import FORMAT_1, RIG, event_from
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.signals import columns

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import IO

    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.values import Event

_SENTENCES_MAX = 20  # sentences
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
        Every cycle that is there and right, shape (n, len(FIELDS) + len(further)), as it was in the ring.
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
    further
        Names of the columns of a row behind `FIELDS`.
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
    further: tuple[str, ...] = ()

    @property
    def block(self) -> Block:
        """Return all periods as one block."""
        return Block(self.rows, self.rig.model.values(), self.further)

    @property
    def columns(self) -> dict[str, NDArray[np.float64]]:
        """Every signal of the table, shape (n,), by name with unit."""
        return columns(self.block)

    def blocks(self, rows: int = 4096) -> Iterator[Block]:
        """Yield the periods in blocks of so many rows at most."""
        whole = self.block
        for first in range(0, len(self.rows), rows):
            yield whole.with_rows(self.rows[first : first + rows])


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
    found = FileContents()
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
    rows, further = found.columns(ordered.rows)
    damage = _told(found, scanner, (*found.faults, *found.messages.faults, *ordered.faults), ordered.gaps)
    unchecked = (_UNCHECKED_NOTE,) if older else ()
    complete = not damage and not unchecked and scanner.closed and scanner.data_checked is True
    if not complete and not damage and not unchecked:
        damage = ("it has no checksum over all of it: another program wrote it",)
    return RecordedRun(
        path, rig, run, rows, ordered.events, complete, ordered.gaps, damage, unchecked, further
    )


def _told(
    found: FileContents, scanner: Scanner, faults: tuple[str, ...], gaps: tuple[Gap, ...]
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


def _rig(path: Path, found: FileContents, run: dict[str, str]) -> Rig:
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
