"""Contents of a recording's file, record by record, before cycles and events are put in order."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from dcmp_hil.common.printable_text import readable
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.recording.mcap_records import Op, RecordError, counts_in, metadata_in
from dcmp_hil.recording.mcap_scanner import Damage, attachment_of
from dcmp_hil.recording.messages import Messages
from dcmp_hil.recording.schema import (
    ABOUT,
    CYCLES,
    END,
    EVENTS,
    FORMAT,
    FORMAT_1,
    FURTHER,
    NUMERICS,
    NUMERICS_1,
    RIG,
    RUN,
)
from dcmp_hil.telemetry.further_columns import fault_of

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from dcmp_hil.recording.mcap_scanner import Record

_TEXT_CHARS_MAX = 10_000  # characters of what is said of a run


class FileContents:
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
        numerics = run.setdefault("numerics", NUMERICS_1)
        if numerics not in {NUMERICS, NUMERICS_1}:
            raise ConfigError(
                f"{path}: a recording with numerics {numerics:.20}; this version computes by those of "
                f"{NUMERICS_1} and {NUMERICS}. Use dcmp-hil {run.get('version', 'of that time'):.40}, or a "
                "newer one."
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

    def columns(self, rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], tuple[str, ...]]:
        """Return the rows and the names of their further columns, which are left out if these are lost."""
        names = self.messages.further
        if names is None:  # the block with the schema is lost
            said = self.attached(FURTHER)
            sound = isinstance(said, list) and all(isinstance(name, str) for name in said)
            names = tuple(said) if sound and not fault_of(said) else ()
        known = len(FIELDS)
        if not len(rows):
            return np.zeros((0, known + len(names))), names
        if rows.shape[1] == known + len(names):
            return rows, names
        self._fault(f"the names of its {rows.shape[1] - known} further columns are lost, and so are they")
        return rows[:, :known], ()

    def _describe(self, record: Record) -> None:
        name, entries = metadata_in(record.content)
        if name == RUN and self._run is None:
            self._run = entries

    def _attach(self, record: Record) -> None:
        attachment = attachment_of(record)
        if attachment.name not in {ABOUT, RIG, END, FURTHER}:
            return
        self.began_ns = self.began_ns or attachment.log_time
        if attachment.log_time != self.began_ns:
            self._fault(f"{attachment.name} of another run is in it")
        elif self._attached.setdefault(attachment.name, attachment.data) != attachment.data:
            self._fault(f"two {attachment.name} in it differ; the first one counts")

    def _fault(self, sentence: str) -> None:
        if sentence not in self.faults:
            self.faults.append(sentence)
