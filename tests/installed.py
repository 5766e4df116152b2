"""The command of an installed wheel: built once for all workers of a test run, started as a process."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import sysconfig
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True, slots=True)
class Finished:
    """A process that ended: its exit code, and what it printed."""

    code: int
    out: str
    err: str


def install(folder: Path) -> Path:
    """Build the wheel and install it into an environment of its own, unless another worker did.

    Parameters
    ----------
    folder
        Where environment and wheel go; the workers of a test run share it.

    Returns
    -------
    Path
        The script `dcmp-hil`. Its dependencies are those of the running interpreter; this checkout is not
        on its path.
    """
    folder.mkdir(parents=True, exist_ok=True)
    script = folder / "venv" / "bin" / "dcmp-hil"
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not script.exists():
            _build(folder)
    return script


def _build(folder: Path) -> None:
    pip = [sys.executable, "-m", "pip", "-q", "--disable-pip-version-check"]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("COV")}
    build = [*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", str(folder), str(ROOT)]
    _check(build, environment)
    (wheel,) = folder.glob("dcmp_hil-*.whl")
    venv = folder / "venv"
    _check([sys.executable, "-m", "venv", "--without-pip", str(venv)], environment)
    # A path in a .pth file is searched, and .pth files there are not read: the editable install stays out.
    (packages,) = venv.glob("lib/python*/site-packages")
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    into = [*pip, "--python", str(venv / "bin" / "python"), "install", "--no-deps", "--no-index"]
    _check([*into, str(wheel)], environment)


def _check(command: list[str], environment: dict[str, str]) -> None:
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr


@contextmanager
def started(script: Path, folder: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Start the script with arguments in a folder; it is gone in the end."""
    with subprocess.Popen(
        [str(script), *arguments], cwd=folder, env=environment(), stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()


def environment(**changes: str | None) -> dict[str, str]:
    """Return the environment without a display, coverage and Python settings; None removes a name."""
    dropped = ("DISPLAY", "WAYLAND_DISPLAY", "PYTHONPATH", "PYTHONHOME", "COLUMNS", "MPLBACKEND")
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in dropped and not name.startswith(("COV", "PYTEST"))
    }
    for name, change in changes.items():
        kept.pop(name, None)
        if change is not None:
            kept[name] = change
    return kept
