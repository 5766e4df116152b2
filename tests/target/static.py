"""Cppcheck with its MISRA addon, and gcc's analyzer, over every program of the firmware."""

from __future__ import annotations

import fnmatch
import functools
import itertools
import json
import re
import shutil
import subprocess
from typing import TYPE_CHECKING, NamedTuple

from tests.firmware.core_library import HERE, law_headers
from tests.target.build import FIRMWARE, needed
from tools.boards import read_boards

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from tools.boards import Board

WHOLE = "bench_f405_dac"  # its program is looked at with the core and the application
TABLE = FIRMWARE.parent / "docs" / "misra.md"

_BENCH = "soc/stm32f4/bench"
_CHIP = ("-I", "core", "-I", "app", "-I", "soc/stm32f4", "-I", _BENCH)
_WARNINGS = (
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wsign-conversion",
    "-Wshadow",
    "-Wundef",
    "-Wstrict-prototypes",
)
_OPTIMISED_ONLY = {"lanes.c"}
"""Files whose many inlined functions take the analyzer minutes without the optimizer."""
_SHORTEST_REASON = 30  # characters: a word or two are none


class Program(NamedTuple):
    """Files that are looked at together, and how they are compiled."""

    sources: tuple[str, ...]  # files and folders
    options: tuple[str, ...]
    for_chip: bool = True

    def files(self) -> list[Path]:
        """Return its C files."""
        found = [FIRMWARE / source for source in self.sources]
        return sorted(path for at in found for path in ([at] if at.suffix == ".c" else at.glob("*.c")))


def _chip_folder() -> tuple[str, ...]:
    """Return what every program for the chip has of its folder."""
    files = sorted((FIRMWARE / "soc/stm32f4").glob("*.c"))
    return tuple(f"soc/stm32f4/{file.name}" for file in files if not file.name.startswith("amplifier_"))


def _of_board(board: Board) -> Program:
    """Return the files that see a board's data; of the first board all its files."""
    own = f"boards/{board.name}"
    options = (*_CHIP, "-I", own)
    if board.amplifier is None:
        return Program((own, "boards/native/plant_port.c"), (*options, "-I", "boards/native"))
    bench = (*_chip_folder(), f"soc/stm32f4/amplifier_{board.amplifier}.c", f"{_BENCH}/bench.c")
    if board.name == WHOLE:
        return Program(("core", "app", *bench, _BENCH), options)
    read = Program(bench, options)
    data = f"{own}/board.h"
    return Program(
        tuple(str(file.relative_to(FIRMWARE)) for file in read.files() if data in _seen_by(file, options)),
        options,
    )


class Finding(NamedTuple):
    """A finding of a tool for one line."""

    rule: str  # "15.5" of MISRA, or cppcheck's own word
    file: str  # from firmware/
    line: int


class Deviation(NamedTuple):
    """A row of docs/misra.md."""

    rule: str
    where: str  # a pattern
    why: str
    version: str = "2.10"  # one of cppcheck that needs it


# ------------------------------------------------------------------------------------ cppcheck


def _addon(folder: Path) -> Path:
    """Write down how the addon is called.

    Cppcheck drops a second finding in a line whose words are those of the first. Without the rules' texts,
    which are not free, all have the same words; with a file that has next to none they say the rule's number.
    """
    texts = folder / "texts.txt"
    texts.write_text("Appendix A Summary of guidelines\nRule 1.1 Required\nNo text.\n")
    call = folder / "misra.json"
    call.write_text(json.dumps({"script": "misra.py", "args": [f"--rule-texts={texts}"]}))
    return call


def version_of(said: str) -> tuple[int, int]:
    """Return what `cppcheck --version` says, without what only mends: 2.13.0 is (2, 13)."""
    found = re.match(r"Cppcheck (\d+)\.(\d+)", said)
    assert found, said
    return int(found[1]), int(found[2])


def cppcheck(program: Program, files: Iterable[Path], folder: Path) -> list[Finding]:
    """Return what cppcheck and the MISRA addon say of some files, compiled like a program's.

    Cppcheck writes its dumps for the addon beside the sources, the older ones under a name without the number
    of the process: the sources are a copy in `folder`, so that two runs at once do not read each other's.
    """
    tree = folder / "firmware"
    if not tree.exists():
        shutil.copytree(FIRMWARE, tree, ignore=shutil.ignore_patterns("build", "*.dump", "*.ctu-info"))
    command = [
        needed("cppcheck"),
        f"--addon={_addon(folder)}",
        "--std=c11",
        "--enable=warning,style,performance,portability",
        f"--platform={'arm32-wchar_t4' if program.for_chip else 'unix64'}",
        "--quiet",
        "--suppress=normalCheckLevelMaxBranches",  # newer ones say that they could look longer
        "--template={file}\t{line}\t{id}",
        "--template-location=",
        *program.options,
        *(str(file.relative_to(FIRMWARE) if file.is_relative_to(FIRMWARE) else file) for file in files),
    ]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    found = set()
    for line in done.stderr.splitlines():
        if line:
            file, number, rule = line.split("\t")
            if file.startswith(str(HERE)):  # the tests' own: only the headers that they include are looked at
                continue
            place = file.removeprefix(f"{FIRMWARE}/")  # of a header that a test includes by its path
            found.add(Finding(rule.removeprefix("misra-c2012-"), place, int(number)))
    return sorted(found)


def _seen_by(file: Path, options: tuple[str, ...]) -> frozenset[str]:
    """Return the headers of ours that a file sees, compiled with these options."""
    folders = tuple(after for before, after in itertools.pairwise(options) if before == "-I")
    return _included(file, folders)


def _folder_of(file: Path) -> tuple[str, ...]:
    """Return the folder of a file, if it is in the firmware's."""
    return (str(file.parent.relative_to(FIRMWARE)),) if file.is_relative_to(FIRMWARE) else ()


@functools.cache
def _included(file: Path, folders: tuple[str, ...]) -> frozenset[str]:
    """Return the headers of ours that a file sees, those of headers too."""
    seen: set[str] = set()
    for name in re.findall(r'^#include "(.+)"', file.read_text(), re.MULTILINE):
        for folder in (*_folder_of(file), *folders):
            header = FIRMWARE / folder / name
            if header.exists():
                seen |= {f"{folder}/{name}"} | _included(header, folders)
                break
    return frozenset(seen)


def headers(program: Program) -> set[str]:
    """Return the headers that a program includes."""
    return set().union(*(_seen_by(file, program.options) for file in program.files()))


PROGRAMS = {board.name: _of_board(board) for board in read_boards().values()} | {
    "native": Program(
        ("core", "boards/native"),
        ("-I", "core", "-I", "boards/native", "-D_XOPEN_SOURCE=700"),
        for_chip=False,
    ),
    "hostlib": Program(("boards/hostlib",), ("-I", "core"), for_chip=False),
    "simlib": Program(("boards/simlib",), ("-I", "core"), for_chip=False),
    "law": Program(
        tuple(map(str, sorted(set(law_headers().values())))),
        ("-I", "core", "-I", str(HERE)),
        for_chip=False,
    ),
}
"""Whole programs, so that what is asked of one has its answer; of the rest what the others do not have."""


def everywhere(said: dict[str, list[Finding]]) -> set[Finding]:
    """Return what is so in the firmware: what one program leaves unused of a header, another one may use."""
    found: set[Finding] = set()
    for finding in {finding for findings in said.values() for finding in findings}:
        seeing = [name for name in said if finding.file in headers(PROGRAMS[name])]
        unused = finding.rule in {"2.3", "2.4", "2.5"}
        if not (unused and seeing) or all(finding in said[name] for name in seeing):
            found.add(finding)
    return found


# ------------------------------------------------------------------------------------- deviations


def deviations(page: str) -> list[Deviation]:
    """Return the page's table, a row for every rule and place; one without a reason is an error."""
    rows = []
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.removeprefix("|").removesuffix("|").split(" | ")]
        if not re.match(r"\| (?!rule)", line):
            continue
        assert len(cells) == 3, f"rule | where | why: {line}"
        assert len(cells[2]) >= _SHORTEST_REASON, f"{cells[0]} has no reason: {line}"
        places = re.findall(r"`([^`]+)`", cells[1])
        assert places, f"{cells[0]} has no place: {line}"
        version = re.search(r" \((2\.\d+)\)$", cells[1])
        rest = (cells[2], version[1]) if version else (cells[2],)
        rows += [Deviation(rule, place, *rest) for rule in cells[0].split(", ") for place in places]
    return rows


def judge(found: Iterable[Finding], rows: list[Deviation], version: str = "2.10") -> Iterator[str]:
    """Yield every finding without a deviation, and every deviation of this version without a finding."""
    idle = {row for row in rows if row.version == version}
    for finding in sorted(found):
        account = [
            row for row in rows if row.rule == finding.rule and fnmatch.fnmatch(finding.file, row.where)
        ]
        idle -= set(account)
        if not account:
            yield f"{finding.file}:{finding.line}: {finding.rule}"
    yield from (f"docs/misra.md: nothing in {row.where} needs {row.rule}" for row in sorted(idle))


# --------------------------------------------------------------------------------- gcc's analyzer


def analyze(program: Program, file: Path, out: Path) -> str:
    """Return the output of gcc's analyzer for a file."""
    mine = (
        [needed("arm-none-eabi-gcc"), "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=soft", "-ffreestanding"]
        if program.for_chip
        else [needed("gcc"), "-fPIC"]
    )
    said = ""
    # The optimizer hides some defects from the analyzer, and uncovers others.
    for level in ("-O2",) if file.name in _OPTIMISED_ONLY else ("-O0", "-O2"):
        command = [
            *mine,
            "-std=c11",
            level,
            "-fanalyzer",
            *_WARNINGS,
            *program.options,
            "-c",
            str(file),
            "-o",
            str(out),
        ]
        done = subprocess.run(command, cwd=FIRMWARE, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        said += done.stderr
    return said
