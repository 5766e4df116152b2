"""Values of a run for its rig file: shown as a diff, and written once that is accepted."""

from __future__ import annotations

import difflib
import os
import secrets
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.common.atomic_file import place_beside, whole_file
from dcmp_hil.config import load_rig
from dcmp_hil.config.edited_text import edited_text
from dcmp_hil.errors import ConfigError
from dcmp_hil.live.start_values import overrides_for_file

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_BOM = "\ufeff"
_LINES_AROUND = 3  # of the file, shown around a change
_PROPOSALS_MAX = 8  # that may still be accepted


class Proposal(NamedTuple):
    """A new text of a rig file, and the text that it was made from."""

    path: Path
    before: bytes
    after: bytes
    diff: str


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
        if not _is_file(source):
            words = ["dcmp-hil", "run", source, *(word for one in overrides for word in ("--set", one))]
            return {"command": shlex.join(words)}
        proposal = _proposal(Path(source), overrides)
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
        path = proposal.path
        try:
            with whole_file(path) as place:
                if path.read_bytes() != proposal.before:
                    raise ConfigError(
                        f"{path}: it was changed meanwhile, and nothing is written. Look at the diff again."
                    )
                place.write_bytes(proposal.after)
        except OSError as error:
            raise ConfigError(f"{path}: {error.strerror}. Nothing is written.") from None
        return str(path)


def _proposal(path: Path, overrides: Sequence[str]) -> Proposal:
    if place_beside(path) is None or not os.access(path, os.W_OK):
        raise ConfigError(f"{path}: it may not be written. Put these into another: {_listed(overrides)}")
    try:
        before = path.read_bytes()
        text = before.decode("utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: not UTF-8 text. Save the file as UTF-8.") from None
    mark = _BOM if text.startswith(_BOM) else ""
    after = mark + edited_text(text.removeprefix(_BOM), overrides, path.name)
    return Proposal(path, before, after.encode(), _diff(text, after, path.name))


def _diff(before: str, after: str, name: str) -> str:
    old, new = before.splitlines(), after.splitlines()
    return "\n".join(difflib.unified_diff(old, new, name, f"{name} (new)", n=_LINES_AROUND, lineterm=""))


def _listed(overrides: Sequence[str]) -> str:
    return ", ".join(overrides)


def _is_file(source: str) -> bool:
    return source.endswith(".toml") or "/" in source
