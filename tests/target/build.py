"""The firmware for its target, built as firmware/README.md says."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
_PACKAGES = {
    "arm-none-eabi-gcc": "gcc-arm-none-eabi",
    "arm-none-eabi-nm": "binutils-arm-none-eabi",
    "clang": "clang",
    "cmake": "cmake",
    "cppcheck": "cppcheck",
    "gcc": "gcc",
    "qemu-system-arm": "qemu-system-arm",
}


def needed(program: str) -> str:
    """Return a program's path; without it, skip, or fail where nothing may be missing."""
    found = shutil.which(program)
    if found is None:
        reason = f"no {program} here: apt install --no-install-recommends {_PACKAGES[program]}"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return found


def build(folder: Path, preset: str, *options: str) -> tuple[Path, str]:
    """Configure and build a preset in a folder of the test's own; return it, and what was said."""
    cmake = needed("cmake")
    needed("clang" if preset.endswith("clang") else "arm-none-eabi-gcc")
    said = ""
    for command in (
        [cmake, "--preset", preset, "-B", str(folder), *options],
        [cmake, "--build", str(folder), "--parallel", "2"],
    ):
        done = subprocess.run(command, cwd=FIRMWARE, capture_output=True, text=True, check=False)
        said += done.stdout + done.stderr
        assert done.returncode == 0, said
    return folder, said
