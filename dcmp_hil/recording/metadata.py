"""Metadata of a recording: versions, computer, checkout."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil import __version__
from dcmp_hil.common.printable_text import readable
from dcmp_hil.config.plugin_check import names_a_class
from dcmp_hil.platform.clock import utc_now
from dcmp_hil.platform.host_info import host_facts
from dcmp_hil.recording.schema import FORMAT, NUMERICS
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.config import Rig

_GIT_TIMEOUT_S = 2.0


def about(rig: Rig, note: str = "", faults: Sequence[str] = (), folder: Path | None = None) -> dict[str, str]:
    """Return everything that is known before a run, in words; facts of the computer as JSON.

    Where the rig names a class of the user's own, `rig_folder` is the folder of the rig's file, as a path
    from `folder`, which the recording is in.
    """
    known = {
        "format": FORMAT,
        "numerics": NUMERICS,
        "version": __version__,
        "rig": rig.name,
        "began": utc_now().isoformat(timespec="milliseconds"),
        "note": note,
        "faults": json.dumps(list(faults)),
        "protocol": f"{PROTOCOL_HASH:08x}",
        "git": git_state(Path(__file__).parent),
        "host": json.dumps(host_facts()),
    }
    if folder is not None and names_a_class(rig):
        known["rig_folder"] = os.path.relpath(rig.plugin_folders[0], folder)
    return {name: readable(text) for name, text in known.items()}


def rig_json(rig: Rig) -> str:
    """Return a rig so that `Rig.model_validate(json.loads(...))` makes the same one; infinity survives."""
    return json.dumps(rig.model_dump(mode="python", exclude_unset=True), default=str)


def git_state(folder: Path) -> str:
    """Return commit and whether anything was changed since; empty where this is no checkout."""
    git = shutil.which("git")
    if git is None:
        return ""
    try:
        commit = _ask(git, folder, "rev-parse", "HEAD")
        changed = _ask(git, folder, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return ""
    return f"{commit} (changed)" if changed else commit


def _ask(git: str, folder: Path, *words: str) -> str:
    done = subprocess.run(  # noqa: S603 - git, with words of our own
        [git, "-C", str(folder), *words], capture_output=True, text=True, timeout=_GIT_TIMEOUT_S, check=True
    )
    return done.stdout.strip()
