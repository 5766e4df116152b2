"""The files of a run whose process was ended by force: written by the telemetry process, which goes on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.cli import console
from dcmp_hil.cli.run_sinks import use_terminal
from dcmp_hil.errors import DcmpError

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.telemetry.summary_sink import SummarySink


@dataclass(frozen=True, slots=True)
class Unattended:
    """Writes summary.json and the file of `--json`, and says so.

    Parameters
    ----------
    rig
        What was run.
    folder
        Of the run; None if it keeps nothing.
    json_file
        Where the figures go as well.
    note, faults
        As asked for.
    """

    rig: Rig
    folder: Path | None
    json_file: str | None
    note: str
    faults: tuple[str, ...]

    def __call__(self, figures: SummarySink, dropped: int, ended_by: str, sentence: str) -> None:
        """Write them, from what telemetry has of the run.

        Parameters
        ----------
        figures
            What the run came to.
        dropped
            Periods that are in no figure.
        ended_by
            How it ended, in a word that stays the same.
        sentence
            The same, for people.
        """
        from dcmp_hil.cli.run_document import run_document, write_json
        from dcmp_hil.common.atomic_file import write_text
        from dcmp_hil.platform.host_info import host_facts
        from dcmp_hil.result import Result

        result = Result(
            rig=self.rig,
            summary=figures.statistics.summary(math.nan),
            columns={},
            events=(),
            dropped=dropped,
            host=host_facts(),
            troubles=tuple(figures.troubles),
        )
        document = run_document(self.rig, self.note, self.faults, result, ended_by)
        use_terminal()
        console.complain(DcmpError(sentence))
        if self.folder is not None and not (self.folder / "summary.json").exists():
            figures_and_rig = {**document, "rig_toml": self.rig.model_dump(mode="json")}
            write_text(self.folder / "summary.json", console.as_json(figures_and_rig))
            console.note(f"kept in {self.folder}/")
        for fault in write_json(self.json_file, document):
            console.warn(fault)
