"""The offer at the end of a run: friction that the observer found, for the rig's file."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from dcmp_hil.cli import console
from dcmp_hil.common.number_range import number
from dcmp_hil.config.edited_file import is_file, propose
from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from dcmp_hil.telemetry.friction_findings import FrictionFindings

_KEY = "model.f1_rad_s2"


def offer(found: FrictionFindings | None, source: str) -> None:
    """Tell a friction that the model should have, as a diff, and the command that writes it.

    Parameters
    ----------
    found
        Of the run; None where no observer finds friction.
    source
        The rig's file, or the name of a shipped rig.
    """
    offered = found.offered if found else None
    if found is None or offered is None:
        return
    override = f"{_KEY}={number(offered)}"
    said = f"the observer found a friction of {number(offered)} rad/s², not {found.model_rad_s2:.3g}"
    if not is_file(source):
        console.note(f"{said}; to use it:", shlex.join(["dcmp-hil", "run", source, "--set", override]))
        return
    path = Path(source)
    try:
        diff = propose(path, [override]).diff
    except ConfigError as error:
        console.note(f"{said}. {error}")
        return
    if diff:
        console.note(f"{said}; this would change the rig:")
        console.err.print(Text(diff), no_wrap=True, overflow="ignore", crop=False)
        console.note(
            "to write it:", shlex.join(["dcmp-hil", "check", _from_here(path), "--set", override, "--write"])
        )


def _from_here(path: Path) -> str:
    """Return a path from the current folder, if it is in it."""
    try:
        return str(path.relative_to(Path.cwd()))
    except (OSError, ValueError):
        return os.fspath(path)
