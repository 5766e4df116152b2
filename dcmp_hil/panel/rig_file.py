"""Values of a run for its rig file: shown as a diff, and written once that is accepted."""

from __future__ import annotations

import secrets
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.config import load_rig
from dcmp_hil.config.edited_file import Proposal, is_file, propose
from dcmp_hil.errors import ConfigError
from dcmp_hil.live.start_values import overrides_for_file

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_PROPOSALS_MAX = 8  # that may still be accepted


class RigFiles:
    """Proposes changes of rig files, and writes those that are accepted."""

    def __init__(self) -> None:
        self._proposals: dict[str, Proposal] = {}

    def propose(
        self, source: str, values: Sequence[str], tables: Mapping[str, Sequence[str]] | None = None
    ) -> dict[str, str]:
        """Return what would put values into the file of a rig.

        Parameters
        ----------
        source
            The rig's file, or the name of a shipped rig.
        values
            Tunable keys of the run, as overrides.
        tables
            By table all that the run's rig states of it, for a table that has another kind in the file.

        Returns
        -------
        dict
            `diff` and the `proposal` to accept; or only `command`, for a shipped rig, which has no file; or
            neither, if the values are those of the rig already.

        Raises
        ------
        ConfigError
            If the file cannot be read, edited or written, or the values break a rule of it.
        """
        there = load_rig(source)
        overrides = overrides_for_file(there, values, tables or {})
        if not overrides:
            return {}
        if not is_file(source):
            words = ["dcmp-hil", "run", source, *(word for one in overrides for word in ("--set", one))]
            return {"command": shlex.join(words)}
        proposal = propose(Path(source), overrides)
        number = secrets.token_urlsafe(12)
        self._proposals[number] = proposal
        while len(self._proposals) > _PROPOSALS_MAX:
            del self._proposals[next(iter(self._proposals))]
        return {"diff": proposal.diff, "proposal": number}

    def accept(self, number: str) -> str:
        """Write what was proposed; return where.

        Raises
        ------
        ConfigError
            If the file is another than the diff was made from, or cannot be written.
        """
        proposal = self._proposals.pop(number, None)
        if proposal is None:
            raise ConfigError("This diff is no longer known. Ask for it again.")
        proposal.write()
        return str(proposal.path)
