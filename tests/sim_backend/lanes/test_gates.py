"""The C of the lanes under the sanitizers, and with every line and branch counted."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from sim_backend.compiling import build
from sim_backend.lanes.engine import LaneEngine
from tests.firmware.core_library import BUILDS, ROOT, WARNINGS, compiler
from tests.sim_backend.lanes.mixed import MIXED_S, mixed

if TYPE_CHECKING:
    from pathlib import Path

_LANES = 8
_COUNTED_S = 2.2  # as long as a ramp to 0 V takes that begins after half a second, and more


def _built(folder: Path, kind: str) -> Path:
    root = build.sources()
    library = folder / f"liblanes_{kind}.so"
    flags = [*WARNINGS, *BUILDS[kind], "-ffp-contract=off", f"-DDCMP_LANES={_LANES}", "-shared", "-fPIC"]
    source = root / "boards/simlib/lanes.c"
    command = [compiler(), *flags, f"-I{root / 'core'}", "-o", str(library), str(source)]
    subprocess.run(command, check=True, cwd=folder)
    return library


def _outcomes(library: Path, seconds: float, **more: str) -> list[str]:
    """Run the mixed rigs in a process of its own."""
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("COV", "PYTEST_"))}
    done = subprocess.run(
        [sys.executable, "-m", "tests.sim_backend.lanes.mixed", str(library), str(_LANES), str(seconds)],
        cwd=ROOT,
        env={**inherited, **more},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-6000:]
    return done.stdout.splitlines()


def _runtime(name: str) -> str:
    command = [compiler(), f"-print-file-name={name}"]
    path = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    if "/" not in path:
        pytest.skip(f"the compiler has no {name} here: apt install gcc libc6-dev")
    return path


def test_sanitizers_find_nothing(tmp_path: Path) -> None:
    preload = f"{_runtime('libasan.so')} {_runtime('libubsan.so')}"
    options = {"LD_PRELOAD": preload, "ASAN_OPTIONS": "detect_leaks=0", "PYTHONMALLOC": "malloc"}
    found = _outcomes(_built(tmp_path, "sanitized"), MIXED_S, **options)
    assert found == [repr(outcome) for outcome in LaneEngine().run(mixed(), MIXED_S)]


def test_every_line_and_branch_is_taken(tmp_path: Path) -> None:
    library = _built(tmp_path, "counted")
    _outcomes(library, _COUNTED_S)
    gcov = shutil.which("gcov")
    assert gcov is not None, "gcov belongs to gcc: apt install gcc"
    data = str(next(tmp_path.glob("*.gcda")))
    command = [gcov, "--branch-probabilities", "--json-format", "--stdout", data]
    read = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    files: list[dict[str, Any]] = json.loads(read.stdout.splitlines()[0])["files"]
    missing = []
    for file in files:
        if "simlib/lanes" in file["file"]:
            name = file["file"].rpartition("/")[2]
            for line in file["lines"]:
                counts = [line["count"], *(branch["count"] for branch in line["branches"])]
                missing += [f"{name}:{line['line_number']}"] * (0 in counts)
    assert len(files) > 5
    assert not missing, " ".join(missing)
