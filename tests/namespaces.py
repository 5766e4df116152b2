"""Commands in a namespace of their own: mounts or a network that nothing else on the computer sees."""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import TYPE_CHECKING

import pytest

from tests.installed import environment

if TYPE_CHECKING:
    from pathlib import Path

_TIMEOUT_S = 240.0  # these machines are shared


def in_own_namespace(kind: str) -> list[str]:
    """Return the words before a command that give it a namespace of its own.

    Parameters
    ----------
    kind
        `mount` or `net`. Where no such namespace can be made, the test is skipped; in CI it fails.
    """
    unshare = shutil.which("unshare")
    flags = [f"--{kind}"] if os.geteuid() == 0 else ["--map-root-user", f"--{kind}"]
    probe = [unshare or "", *flags, "true"]
    if unshare is None or subprocess.run(probe, check=False, capture_output=True).returncode:
        needs = (
            f"this test needs a {kind} namespace: as root, or where users may make them "
            "(sysctl kernel.unprivileged_userns_clone=1)"
        )
        if os.environ.get("CI") == "true":
            pytest.fail(needs)
        pytest.skip(needs)
    return [unshare, *flags]


def on_disk_of(size: str, folder: Path, *command: str) -> subprocess.CompletedProcess[str]:
    """Run a command where `runs/` is a disk of a size, such as 64k; copy what it left there to `kept/`."""
    (folder / "runs").mkdir()
    kept = 'mount -t tmpfs -o size="$0" none runs && "$@"; code=$?; cp -r runs kept; exit $code'
    return subprocess.run(
        [*in_own_namespace("mount"), "sh", "-c", kept, size, *command],
        cwd=folder, env=environment(), check=False, capture_output=True, text=True, timeout=_TIMEOUT_S,
    )  # fmt: skip
