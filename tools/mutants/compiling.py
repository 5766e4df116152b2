"""Mutants made libraries, those left out that cannot differ from what they were made of."""

from __future__ import annotations

import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tests.firmware.core_library import (
    APP,
    CORE,
    HERE,
    LAW,
    app_sources,
    check_sources,
    compiler,
    law_checks,
    sources,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from tools.mutants.generate import Mutant

COMPARED = ("-O2",)
RUN = ("-O1", "-fstack-protector-all", "-fsanitize=undefined", "-fsanitize-undefined-trap-on-error")
"""What means nothing in C ends a mutant, and so does a smashed stack; that needs no runtime library."""
WHOLE = ("-std=c11", "-ffreestanding", "-fPIC", "-w", *LAW, f"-I{CORE}", f"-I{APP}", f"-I{HERE}")


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


def translation_units(path: Path, source: bytes) -> dict[str, bytes]:
    """Return what is compiled of a file, by the name of the object.

    A header is compiled in the files of the tests that use all of it. It stands in front of them, so that
    its guard keeps the original out.
    """
    if path.suffix == ".c":
        return {path.name: source}
    units = {}
    for check in law_checks(path):
        kind = b"#define DCMP_REAL_FLOAT\n" if "_float_" in check.name else b""
        units[check.name] = kind + source + f'\n#include "{check.name}"\n'.encode()
    return units


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
        self.paths = {path.name: path for path in [*sources(), *app_sources(), *check_sources()]}
        self.headers = {path.name: path for path in CORE.glob("*.h")}
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

    def _units(self, mutant: Mutant) -> dict[str, bytes]:
        return translation_units({**self.paths, **self.headers}[mutant.file], mutant.source)

    def _objects(self, units: dict[str, bytes], flags: Sequence[str], prefix: str) -> dict[str, Path] | None:
        """Compile units; None if one of them does not compile."""
        made = {name: self.folder / f"{prefix}{name}.o" for name in units}
        whole = all(compile_source(source, flags, made[name]) for name, source in units.items())
        return made if whole else None

    def _bytes_of(self, units: dict[str, bytes], prefix: str) -> bytes | None:
        """Return what the compiler makes of units."""
        made = self._objects(units, COMPARED, prefix)
        return None if made is None else b"".join(path.read_bytes() for path in made.values())

    def _compared(self, numbered: tuple[int, Mutant]) -> bytes | None:
        number, mutant = numbered
        units = self._units(mutant)
        compiled = self._bytes_of(units, f"{number}.compared.")
        for name in units:
            (self.folder / f"{number}.compared.{name}.o").unlink(missing_ok=True)
        return compiled

    def _library(self, numbered: tuple[int, Mutant]) -> Path:
        number, mutant = numbered
        library = self.folder / f"{number}.so"
        built = self._objects(self._units(mutant), RUN, f"{number}.")
        if built is None:
            raise RuntimeError(f"{mutant.file}:{mutant.row} compiles by {COMPARED}, but not by {RUN}")
        self._link({**self.objects, **built}, library)
        for path in built.values():
            path.unlink()
        return library

    def _unchanged(self, file: str) -> bytes:
        path = {**self.paths, **self.headers}[file]
        compiled = self._bytes_of(translation_units(path, path.read_bytes()), f"{file}.compared.")
        if compiled is None:
            raise RuntimeError(f"{path} does not compile: make pytest ARGS=tests/firmware says why")
        return compiled

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
                (file, self._unchanged(file)): "the same as the original"
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
