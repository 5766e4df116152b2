"""The fuzz target, built by clang for libFuzzer, and by gcc to count branches."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "firmware" / "core"
TARGET = ROOT / "firmware" / "fuzz"

_MISSING_REMEDY = "libFuzzer is missing here: apt install --no-install-recommends clang libclang-rt-dev"
_C_FLAGS = ("-std=c11", "-D_POSIX_C_SOURCE=200809L", "-g", f"-I{CORE}", "-w")
# What the core compares is of no use to mutations, since its frames are made with their checksums: counting
# edges alone is what makes the difference between 17,000 and 50,000 executions a second.
_COUNTED_FLAGS = ("-fsanitize-coverage=inline-8bit-counters,pc-table",)
_CHECKED_FLAGS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")

_Job = tuple[Path, tuple[str, ...]]  # a file and how it is compiled


@dataclass(frozen=True)
class Edit:
    """One place of a core's file that is made wrong."""

    file: str
    right: str
    wrong: str

    def made(self) -> str:
        """Return the text of the file with the error.

        Raises
        ------
        RuntimeError
            If the place is not there, or there twice.
        """
        text = (CORE / self.file).read_text("utf-8")
        if text.count(self.right) != 1:
            raise RuntimeError(f"{self.file} has {text.count(self.right)} times {self.right!r}, not once")
        return text.replace(self.right, self.wrong)


@functools.cache
def clang() -> str:
    """Return the path of a clang that has libFuzzer.

    Raises
    ------
    RuntimeError
        If there is none.
    """
    found = shutil.which("clang")
    if found is None:
        raise RuntimeError(_MISSING_REMEDY)
    probe = [found, "-fsanitize=fuzzer,address,undefined", "-x", "c", "-", "-o", os.devnull]
    target = "int LLVMFuzzerTestOneInput(const unsigned char *d, unsigned long n) { return !d && n; }"
    if subprocess.run(probe, input=target, text=True, capture_output=True, check=False).returncode:  # noqa: S603
        raise RuntimeError(_MISSING_REMEDY)
    return found


def core_files() -> list[Path]:
    """Return the core's C files."""
    return sorted(CORE.glob("*.c"))


def target_files() -> list[Path]:
    """Return the source files of the target and its model."""
    return sorted(path for path in TARGET.glob("*.c") if path.name != "replay.c")


def _compile(compiler: str, source: Path, flags: tuple[str, ...], target: Path) -> Path:
    subprocess.run([compiler, *_C_FLAGS, *flags, "-c", str(source), "-o", str(target)], check=True)  # noqa: S603
    return target


class Workshop:
    """A folder with the objects that every fuzz target shares, made once.

    Raises
    ------
    RuntimeError
        If clang or libFuzzer is missing.
    """

    def __init__(self, folder: Path, jobs: int = 2) -> None:
        self._folder = folder
        self._clang = clang()
        jobs_of: list[_Job] = [(path, (*_COUNTED_FLAGS, *_CHECKED_FLAGS, "-O2")) for path in core_files()]
        jobs_of += [(path, ("-O2",)) for path in target_files()]  # what is not under test pays for no checks
        with ThreadPoolExecutor(jobs) as pool:
            made = pool.map(
                lambda job: _compile(self._clang, job[0], job[1], folder / f"{job[0].stem}.o"), jobs_of
            )
            self._objects = {path.name: built for (path, _), built in zip(jobs_of, made, strict=True)}

    def program(self, name: str, edit: Edit | None = None) -> Path:
        """Return the fuzz target, its core with an error in it if one is named."""
        objects = dict(self._objects)
        if edit is not None:
            source = self._folder / f"{name}.{edit.file}"
            source.write_text(edit.made(), "utf-8")
            objects[edit.file] = _compile(
                self._clang, source, (*_COUNTED_FLAGS, *_CHECKED_FLAGS, "-O2"), self._folder / f"{name}.o"
            )
        program = self._folder / name
        command = [
            self._clang,
            "-fsanitize=fuzzer",
            *_CHECKED_FLAGS,
            *map(str, objects.values()),
            "-o",
            str(program),
        ]
        subprocess.run(command, check=True)  # noqa: S603
        return program


def counting_program(folder: Path, compiler: str = "gcc", jobs: int = 2) -> Path:
    """Return a program that replays inputs and counts the branches of the core, in a folder of its own."""
    jobs_of: list[_Job] = [(path, ("-O0", "--coverage")) for path in core_files()]
    jobs_of += [(path, ("-O1",)) for path in [*target_files(), TARGET / "replay.c"]]
    with ThreadPoolExecutor(jobs) as pool:
        objects = list(
            pool.map(lambda job: _compile(compiler, job[0], job[1], folder / f"{job[0].stem}.o"), jobs_of)
        )
    program = folder / "replay"
    subprocess.run([compiler, "--coverage", *map(str, objects), "-o", str(program)], check=True)  # noqa: S603
    return program
