"""The firmware's C sources, compiled for this computer once and kept in the user's cache."""

from __future__ import annotations

import hashlib
import os
import shlex
import shutil
import subprocess
import tempfile
from pathlib import Path

from dcmp_hil.errors import OpenError

_HERE = Path(__file__).parent
_FLAGS = ("-std=c11", "-O2", "-Wall", "-Wextra", "-ffp-contract=off")
_SECONDS = 120


def library() -> Path:
    """Return the core as a shared library (boards/hostlib).

    Raises
    ------
    OpenError
        If there is no compiler, it fails, or the cache cannot be written.
    """
    return _built("hostlib", "libdcmp.so", ("-shared", "-fPIC", "-fvisibility=default"))


def program() -> Path:
    """Return the native board as a program (boards/native).

    Raises
    ------
    OpenError
        If there is no compiler, it fails, or the cache cannot be written.
    """
    return _built("native", "dcmp-native", ("-D_GNU_SOURCE",))


def sources() -> Path:
    """Return the folder of the C sources: in the wheel beside this file, in a checkout at its top."""
    return next(folder for folder in (_HERE / "firmware", _HERE.parent / "firmware") if folder.is_dir())


def _built(board: str, name: str, flags: tuple[str, ...]) -> Path:
    root = sources()
    files = sorted([*root.glob("core/*.[ch]"), *root.glob(f"boards/{board}/*.[ch]")])
    compiler = _compiler()
    key = hashlib.sha256(" ".join([*compiler, _version(compiler), *_FLAGS, *flags]).encode())
    for file in files:
        key.update(file.name.encode() + b"\0" + file.read_bytes())
    folder = _cache() / key.hexdigest()[:16]
    target = folder / name
    if not target.exists():
        _compile(compiler, flags, root, [file for file in files if file.suffix == ".c"], board, target)
    return target


def _compiler() -> list[str]:
    asked = shlex.split(os.environ.get("CC", ""))
    if asked:
        return asked
    found = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    if found is None:
        raise OpenError("There is no C compiler to build the virtual device with: apt install gcc libc6-dev")
    return [found]


def _version(compiler: list[str]) -> str:
    return _run([*compiler, "--version"], compiler)


def _cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "dcmp-hil"


def _compile(
    compiler: list[str], flags: tuple[str, ...], root: Path, files: list[Path], board: str, target: Path
) -> None:
    """Compile beside the target and rename: two processes at once do no harm."""
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            made = Path(folder) / target.name
            includes = [f"-I{root / 'core'}", f"-I{root / 'boards' / board}"]
            _run([*compiler, *_FLAGS, *flags, *includes, "-o", str(made), *map(str, files)], compiler)
            made.replace(target)
    except OSError as error:
        raise OpenError(
            f"{target.parent}: {error.strerror or error}. The virtual device is built there; point "
            "XDG_CACHE_HOME at a folder you may write in."
        ) from error


def _run(command: list[str], compiler: list[str]) -> str:
    try:
        done = subprocess.run(  # noqa: S603 - the compiler, with our own files
            command, capture_output=True, text=True, timeout=_SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise OpenError(
            f"{compiler[0]}: the C compiler cannot be run ({error}). Set CC to one that can, or: "
            "apt install gcc libc6-dev"
        ) from error
    if done.returncode:
        first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[-200:])
        raise OpenError(
            f"{compiler[0]}: the virtual device could not be compiled: {first.strip()} "
            "If headers are missing: apt install gcc libc6-dev"
        )
    return done.stdout
