"""Mutants made libraries, those left out that cannot differ from what they were made of."""

from __future__ import annotations

import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tests.firmware.core_library import APP, CORE, HERE, app_sources, compiler, sources

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from tools.mutants.generate import Mutant

COMPARED = ("-O2",)
RUN = ("-O1", "-fstack-protector-all", "-fsanitize=undefined", "-fsanitize-undefined-trap-on-error")
"""What means nothing in C ends a mutant, and so does a smashed stack; that needs no runtime library."""
WHOLE = ("-std=c11", "-ffreestanding", "-fPIC", "-w", f"-I{CORE}", f"-I{APP}", f"-I{HERE}")


@dataclass(frozen=True)
class Compiled:
    """A mutant that can be tried, or why it cannot."""

    mutant: Mutant
    library: Path | None
    dropped: str = ""


def compile_source(source: bytes, flags: Sequence[str], target: Path) -> bool:
    """Compile C into an object; say whether it could be."""
    command = [compiler(), *WHOLE, *flags, "-x", "c", "-c", "-", "-o", str(target)]
    return subprocess.run(command, input=source, capture_output=True, check=False).returncode == 0  # noqa: S603


class Workshop:
    """A folder with the objects that all mutants share.

    Raises
    ------
    RuntimeError
        If the sources themselves do not compile.
    """

    def __init__(self, folder: Path, jobs: int) -> None:
        self.folder = folder
        self.jobs = jobs
        self.paths = {path.name: path for path in [*sources(), *app_sources(), HERE / "core_checks.c"]}
        with ThreadPoolExecutor(jobs) as pool:
            objects = list(pool.map(lambda path: self._original(path, RUN, ".o"), self.paths.values()))
        self.objects = dict(zip(self.paths, objects, strict=True))
        self.whole = folder / "original.so"
        self._link(self.objects, self.whole)

    def _original(self, path: Path, flags: Sequence[str], ending: str) -> Path:
        target = self.folder / (path.stem + ending)
        if not compile_source(path.read_bytes(), flags, target):
            raise RuntimeError(f"{path} does not compile: make pytest ARGS=tests/firmware says why")
        return target

    def _link(self, objects: dict[str, Path], target: Path) -> None:
        command = [compiler(), "-shared", "-nostdlib", *map(str, objects.values()), "-o", str(target)]
        subprocess.run(command, check=True)  # noqa: S603

    def _compared(self, numbered: tuple[int, Mutant]) -> bytes | None:
        number, mutant = numbered
        target = self.folder / f"{number}.compared.o"
        if not compile_source(mutant.source, COMPARED, target):
            return None
        compiled = target.read_bytes()
        target.unlink()
        return compiled

    def _library(self, numbered: tuple[int, Mutant]) -> Path:
        number, mutant = numbered
        built, library = self.folder / f"{number}.o", self.folder / f"{number}.so"
        if not compile_source(mutant.source, RUN, built):
            raise RuntimeError(f"{mutant.file}:{mutant.row} compiles by {COMPARED}, but not by {RUN}")
        self._link({**self.objects, mutant.file: built}, library)
        built.unlink()
        return library

    def compile(self, mutants: Sequence[Mutant], named: Sequence[Mutant] = ()) -> list[Compiled]:
        """Compile mutants, each once: what the compiler makes the same of is the same.

        Parameters
        ----------
        mutants
            Those to try.
        named
            Those that may live. What the compiler makes the same of as of one of them is dropped, also where
            that one itself was not drawn.
        """
        keys = {mutant.key for mutant in named}
        with ThreadPoolExecutor(self.jobs) as pool:
            compared = list(pool.map(self._compared, enumerate(mutants)))
            may_live = {
                (mutant.file, compiled)
                for mutant, compiled in zip(
                    named, pool.map(self._compared, enumerate(named, start=len(mutants))), strict=True
                )
            }
            known = {
                (
                    file,
                    self._original(self.paths[file], COMPARED, ".compared.o").read_bytes(),
                ): "the same as the original"
                for file in {mutant.file for mutant in mutants}
            }
            why = []
            for mutant, compiled in zip(mutants, compared, strict=True):
                key = (mutant.file, compiled or b"")
                reason = "does not compile" if compiled is None else known.get(key, "")
                if not reason and key in may_live and mutant.key not in keys:
                    reason = "the same as a named mutant"
                if not reason:
                    known[key] = "the same as another mutant"
                why.append(reason)
            libraries = pool.map(
                lambda given: None if given[1] else self._library(given[0]),
                zip(enumerate(mutants), why, strict=True),
            )
            return [Compiled(*each) for each in zip(mutants, libraries, why, strict=True)]
