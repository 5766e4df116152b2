"""C sources of the firmware, compiled for this computer once and kept in the user's cache."""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from dcmp_hil.errors import OpenError
from sim_backend.compiling import cache

_PACKAGE_ROOT = Path(__file__).parents[1]
_SOURCE_FOLDERS = (  # in the wheel; in a checkout
    _PACKAGE_ROOT / "firmware",
    _PACKAGE_ROOT.parent / "firmware",
)
_COMPILER_FLAGS = ("-std=c11", "-O2", "-Wall", "-Wextra")
_COMPILE_TIMEOUT_S = 120
_INSTALL_REMEDY = "apt install gcc libc6-dev"

SHARED = ("-shared", "-fPIC", "-fvisibility=hidden")
"""Flags of a shared library."""


@dataclass(frozen=True, slots=True)
class Target:
    """A file to be made of sources under `firmware`.

    Parameters
    ----------
    what
        Of messages, such as `the virtual device`.
    name
        Of the file that is made.
    files
        Patterns of sources and headers: a change in one of them compiles anew, and those in .c are compiled.
    flags
        Further flags for the compiler; of two that contradict each other, the last one counts.
    """

    what: str
    name: str
    files: tuple[str, ...]
    flags: tuple[str, ...]


def compiled(target: Target) -> Path:
    """Return the file of a target; compile it if it is not there yet.

    Raises
    ------
    OpenError
        If there is no compiler, it fails, or the cache cannot be written.
    """
    root = sources()
    files = sorted(file for pattern in target.files for file in root.glob(pattern))
    compiler = _compiler(target.what)
    key = hashlib.sha256(repr((compiler, version(compiler), _COMPILER_FLAGS, target.flags)).encode())
    for file in files:
        key.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    with cache.folder(key.hexdigest()[:16], target.what) as folder:
        found = cache.find(folder, target.name)
        return found or _compile(
            [*compiler, *_COMPILER_FLAGS, *target.flags, f"-I{root / 'core'}"], files, folder, target
        )


def sources() -> Path:
    """Return the folder of the C sources.

    Raises
    ------
    OpenError
        If they were not installed.
    """
    for folder in _SOURCE_FOLDERS:
        if (folder / "core").is_dir():
            return folder
    raise OpenError(f"{_SOURCE_FOLDERS[0]}: the firmware's sources are missing. Install dcmp-hil again.")


def version(compiler: list[str]) -> str:
    """Return what a compiler says of itself.

    Raises
    ------
    OpenError
        If it cannot be run.
    """
    return _run([*compiler, "--version"], "")


def _compiler(what: str) -> list[str]:
    try:
        asked = shlex.split(os.environ.get("CC", ""))
    except ValueError as error:
        raise OpenError(f"CC={os.environ['CC']}: {error}. Set CC to the name of a C compiler.") from error
    if asked:
        return asked
    found = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    if found is None:
        raise OpenError(
            f"{what[0].upper()}{what[1:]} needs a C compiler, and there is none: {_INSTALL_REMEDY}"
        )
    return [found]


def _compile(command: list[str], files: list[Path], folder: Path, target: Target) -> Path:
    """Compile beside the kept file and rename: two processes at once do no harm."""
    inputs = [str(file) for file in files if file.suffix == ".c"]
    with tempfile.TemporaryDirectory(dir=folder) as beside:
        made = Path(beside) / target.name
        _run([*command, "-o", str(made), *inputs], target.what)
        return cache.keep(made, folder)


def _run(command: list[str], what: str) -> str:
    try:
        done = subprocess.run(  # noqa: S603 - the compiler, with our own files
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_COMPILE_TIMEOUT_S,
            check=False,
            start_new_session=True,  # Ctrl-C is for us
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise OpenError(
            f"{command[0]}: the C compiler cannot be run ({error}). Set CC to one that can, or: "
            f"{_INSTALL_REMEDY}"
        ) from error
    if done.returncode < 0:
        raise OpenError(
            f"{command[0]}: the C compiler was interrupted (signal {-done.returncode}). Start again."
        )
    if done.returncode:
        said = [line.strip() for line in done.stderr.splitlines() if "error" in line] or [
            " ".join(done.stderr[-200:].split())
        ]
        raise OpenError(
            f"{command[0]}: {what} does not compile: {said[0]}. "
            f"If it is a header that is missing: {_INSTALL_REMEDY}"
        )
    return done.stdout
