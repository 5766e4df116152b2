"""Which branches of the core a corpus reaches, by gcov."""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import TYPE_CHECKING, NamedTuple

from tools.fuzz.build import CORE, core_files, counting_program

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_FILES_PER_COMMAND_MAX = 1000  # files a command

UNREACHED: dict[str, str] = {}
"""Lines of the core, "dcmp_x.c: the line's text", that no input can reach, and why. There is none."""


class Reach(NamedTuple):
    """Branches reached, of how many, and those not reached."""

    lines: int
    all_lines: int
    branches: int
    all_branches: int
    missing: tuple[str, ...]


def _reports(folder: Path) -> list[dict[str, object]]:
    gcov = shutil.which("gcov")
    if gcov is None:
        raise RuntimeError("gcov is missing here, which belongs to gcc: apt install gcc")
    found = []
    for source in core_files():
        asked = [gcov, "--branch-probabilities", "--json-format", "--stdout", f"{source.stem}.gcda"]
        read = subprocess.run(asked, cwd=folder, capture_output=True, text=True, check=True)  # noqa: S603
        for line in read.stdout.splitlines():
            found += [file for file in json.loads(line)["files"] if file["file"] == str(source)]
    return found


def reach(folder: Path, inputs: Sequence[Path]) -> Reach:
    """Replay inputs in a build with coverage; return the branches reached.

    Raises
    ------
    RuntimeError
        If there is no gcov.
    """
    program = counting_program(folder)
    for start in range(0, len(inputs), _FILES_PER_COMMAND_MAX):
        some = [str(path) for path in inputs[start : start + _FILES_PER_COMMAND_MAX]]
        subprocess.run([str(program), *some], cwd=folder, check=True, stderr=subprocess.DEVNULL)  # noqa: S603
    lines = branches = all_lines = all_branches = 0
    missing = []
    for report in _reports(folder):
        name = str(report["file"]).rsplit("/", 1)[-1]
        text = (CORE / name).read_text("utf-8").splitlines()
        for line in report["lines"]:  # type: ignore[attr-defined]
            taken = [branch["count"] > 0 for branch in line["branches"]]
            lines += line["count"] > 0
            branches += sum(taken)
            all_lines += 1
            all_branches += len(taken)
            at = text[line["line_number"] - 1].strip()
            if (not line["count"] or not all(taken)) and f"{name}: {at}" not in UNREACHED:
                missing.append(f"{name}:{line['line_number']}: {at}")
    return Reach(lines, all_lines, branches, all_branches, tuple(missing))
