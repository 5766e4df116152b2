"""Mutants compiled and tried, on as many processors as are given."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from tests.firmware.core_library import HERE, ROOT, law_headers
from tools.mutants.compiling import Workshop

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tools.mutants.compiling import Compiled
    from tools.mutants.generate import Mutant

_STATE = (
    *("amplifier", "drive", "encoder_speed", "encoder_travel", "encoder_jumps", "encoder_state"),
    *("memory", "sessions", "supervisor", "watchdog"),
)
_AROUND = ("app", "boot_count", "latched", "parameters", "records", "reports", "rings")
_LAW = [header.stem.removeprefix("dcmp_") for header in law_headers()]
TESTS = tuple(str(HERE / "core" / f"test_{name}.py") for name in (*_STATE, *_AROUND, *_LAW))
"""Those of what is mutated: checksums, messages and byte streams are not."""

SINGLE = {"OPENBLAS_NUM_THREADS": "1"}
"""A process that forks has no other threads."""


@dataclass(frozen=True)
class Verdict:
    """Result for a mutant: `tests`, `time`, `survived` or `dropped`, and the test or the reason."""

    mutant: Mutant
    what: str
    by: str


def _start(
    folder: Path, job: int, share: Sequence[tuple[int, str, str]], tests: Sequence[str]
) -> subprocess.Popen[str]:
    """Start a process that tries its share of the mutants."""
    task = {"original": str(folder / "original.so"), "mutants": share}
    (folder / f"task{job}.json").write_text(json.dumps(task), "utf-8")
    # pytest-cov's and xdist's variables are not for a process that they did not start
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("COV", "PYTEST_"))}
    files = [str(folder / f"task{job}.json"), str(folder / f"result{job}.json")]
    command = [sys.executable, "-m", "tools.mutants.trial", *files, *tests]
    return subprocess.Popen(  # noqa: S603
        command, cwd=ROOT, env=inherited | SINGLE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def _tried(
    folder: Path, compiled: Sequence[Compiled], jobs: int, tests: Sequence[str]
) -> dict[int, tuple[str, str]]:
    """Try what can be tried; return verdict and test by number."""
    whole = [(i, each.mutant.file, str(each.library)) for i, each in enumerate(compiled) if each.library]
    started = [_start(folder, job, whole[job::jobs], tests) for job in range(jobs)]
    found: dict[int, tuple[str, str]] = {}
    for job, process in enumerate(started):
        said, _ = process.communicate()
        result = folder / f"result{job}.json"
        if process.returncode or not result.exists():
            raise RuntimeError(f"the trials failed:\n{said[-3000:]}")
        found.update({number: (what, by) for number, what, by in json.loads(result.read_text("utf-8"))})
    return found


def verdicts(
    mutants: Sequence[Mutant], jobs: int, tests: Sequence[str] = TESTS, named: Sequence[Mutant] = ()
) -> list[Verdict]:
    """Compile mutants and run tests on each until one fails; `named` are those that may live.

    Raises
    ------
    RuntimeError
        If the sources do not compile, or the tests fail without a mutant.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compiled = Workshop(folder, jobs).compile(mutants, named)
        found = _tried(folder, compiled, jobs, tests)
    return [
        Verdict(each.mutant, *found.get(number, ("dropped", each.dropped)))
        for number, each in enumerate(compiled)
    ]
