"""Restrictions for the recording of another user: no imports, no files, no impossible numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dcmp_hil.config.sections import Custom
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.ring import FIELDS

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.config import Rig
    from dcmp_hil.control.references.table import Table
    from dcmp_hil.recording.reader import RecordedRun
    from dcmp_hil.values import Reference

_T, _FAULT = FIELDS.index("t"), FIELDS.index("fault")
_FAULT_CODES_MAX = 256  # codes


def named_in(rig: Rig) -> dict[str, str]:
    """Return the classes that a rig names, by key of rig.toml; nothing is imported or looked for."""
    sections = {"backend": rig.backend, "observer": rig.observer, "controller": rig.controller}
    return {f"{key}.kind": part.kind for key, part in sections.items() if isinstance(part, Custom)}


def refuse_named(recorded: RecordedRun, rig: Rig) -> None:
    """Refuse to run a class that the recording names, and not the caller.

    Parameters
    ----------
    recorded
        The run.
    rig
        What is to be run.

    Raises
    ------
    ConfigError
        If it is to be run.
    """
    named, wanted = named_in(recorded.rig), named_in(rig)
    both = [
        f'{key} = "{kind}"'
        for key, kind in named.items()
        if key != "backend.kind" and wanted.get(key) == kind
    ]
    if both:
        raise ConfigError(
            f"{recorded.path}: the rig in it names {' and '.join(both)}, and a replay runs that code. If you "
            "know where it comes from, say --trust; --set controller.kind=pd, --observer super_twisting and "
            "their like replay it without."
        )


def check_numbers(recorded: RecordedRun) -> None:
    """Check that time rises and that every fault is a code.

    Raises
    ------
    ConfigError
        If not, with the first period where it is so.
    """
    times, faults = recorded.rows[:, _T], recorded.rows[:, _FAULT]
    with np.errstate(invalid="ignore"):
        wrong = ~(np.isfinite(times) & (faults >= 0) & (faults < _FAULT_CODES_MAX))
        wrong[1:] |= ~(np.diff(times) > 0.0)
    if wrong.any():
        k = int(np.argmax(wrong))
        raise ConfigError(
            f"{recorded.path}: period {k + 1} has t = {times[k]:g} s and fault = {faults[k]:g}; time must "
            f"rise, and a fault is a code below {_FAULT_CODES_MAX}. No run of dcmp-hil wrote that."
        )


class UnreadTable:
    """A reference from a file that a recording names: asked for, it is refused.

    Parameters
    ----------
    path
        Of the recording.
    table
        The reference.
    """

    def __init__(self, path: Path, table: Table) -> None:
        self._path, self._table = path, table

    def at(self, t: float) -> Reference:  # noqa: ARG002 - as every reference
        """Raise: the file of the reference is not read.

        Raises
        ------
        ConfigError
            Always.
        """
        raise ConfigError(
            f'{self._path}: this replay needs the file "{self._table.file}" that the rig in it names, for '
            "the friction that it tells the observer of. If you know where it comes from, say --trust."
        )
