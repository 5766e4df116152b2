"""The core's tests once more: under the sanitizers, and with every line and branch counted."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from tests.firmware.core_library import (
    HERE,
    PREBUILT,
    ROOT,
    app_sources,
    build,
    compiler,
    law_headers,
    sources,
)

if TYPE_CHECKING:
    from pathlib import Path


def _run_core_tests(library: Path, **more: str) -> None:
    """Run every test of core/ in a process of its own."""
    # pytest-cov's and xdist's variables are not for a process that they did not start
    inherited = {k: v for k, v in os.environ.items() if not k.startswith(("COV", "PYTEST_"))}
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-s",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:xdist",
        "-p",
        "no:cov",
    ]
    done = subprocess.run(
        [*command, str(HERE / "core")],
        cwd=ROOT,
        env={**inherited, PREBUILT: str(library), **more},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, (done.stdout + done.stderr)[-6000:]


def _runtime(name: str) -> str:
    found = subprocess.run(
        [compiler(), f"-print-file-name={name}"], capture_output=True, text=True, check=True
    )
    path = found.stdout.strip()
    if "/" not in path:
        reason = f"the compiler has no {name} here: apt install gcc libc6-dev"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return path


def test_sanitizers(tmp_path: Path) -> None:
    preload = f"{_runtime('libasan.so')} {_runtime('libubsan.so')}"
    library = build(tmp_path, "sanitized")
    _run_core_tests(library, LD_PRELOAD=preload, ASAN_OPTIONS="detect_leaks=0", PYTHONMALLOC="malloc")


def _counted(folder: Path) -> dict[str, dict[str, Any]]:
    """Return gcov's figures of every file of the core; of the law's headers in double precision."""
    gcov = shutil.which("gcov")
    assert gcov is not None, "gcov belongs to gcc: apt install gcc"
    files = {}
    compiled = {source: source for source in [*sources(), *app_sources()]} | law_headers()
    for counted, source in compiled.items():
        command = [
            gcov,
            "--branch-probabilities",
            "--json-format",
            "--stdout",
            str(folder / f"{source.stem}.gcda"),
        ]
        read = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
        for report in read.stdout.splitlines():
            files.update({f["file"]: f for f in json.loads(report)["files"] if f["file"] == str(counted)})
    return files


def test_every_line_and_branch(tmp_path: Path) -> None:
    _run_core_tests(build(tmp_path, "counted"))
    files = _counted(tmp_path)
    missing = []
    print(f"\n{'file':24}{'lines':>12}{'branches':>12}")  # noqa: T201
    for source in [*sources(), *app_sources(), *law_headers()]:
        lines = files[str(source)]["lines"]
        branches = [(line["line_number"], branch["count"]) for line in lines for branch in line["branches"]]
        dead = {line["line_number"] for line in lines if not line["count"]}
        half = {number for number, count in branches if not count}
        taken = sum(1 for _, count in branches if count)
        row = f"{len(lines) - len(dead):>6}/{len(lines):<5}{taken:>6}/{len(branches):<5}"
        print(f"{source.name:24}{row}")  # noqa: T201
        missing += [f"{source.name}:{number}" for number in sorted(dead | half)]
    assert not missing
