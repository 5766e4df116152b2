"""The firmware's core and what boards with a chip share: built by the C compiler, reached through cffi."""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from cffi import FFI

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "firmware" / "core"
APP = ROOT / "firmware" / "app"
HERE = Path(__file__).resolve().parent
DBC = ROOT / "firmware" / "proto" / "dcmp.dbc"

PREBUILT = "DCMP_CORE_LIBRARY"
"""Environment: a library that was built already, the sanitized or the counting one."""

WARNINGS = [
    *("-std=c11", "-ffreestanding", "-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow"),
    *("-Wundef", "-Wstrict-prototypes", "-Werror"),
]
LAW = ["-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
"""What the headers of the law ask for; the rest of the core has no floating point."""
BUILDS = {
    "plain": ["-O2"],
    "sanitized": [
        "-O1",
        "-g",
        "-fsanitize=address,undefined",
        "-fno-sanitize-recover",
        "-fno-omit-frame-pointer",
    ],
    "counted": ["-O0", "-g", "--coverage"],
}


def compiler() -> str:
    """Return the C compiler; without one, skip, or fail where nothing may be missing."""
    found = os.environ.get("CC") or shutil.which("gcc") or shutil.which("cc")
    if found is None:
        reason = "no C compiler here: apt install gcc"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return found


def sources() -> list[Path]:
    """Return the core's C files."""
    return sorted(CORE.glob("*.c"))


def app_sources() -> list[Path]:
    """Return the C files that boards with a chip share."""
    return sorted(APP.glob("*.c"))


def check_sources() -> list[Path]:
    """Return the C files of the tests, which the law's headers are compiled in."""
    return sorted(HERE.glob("*_checks.c"))


def law_headers() -> dict[Path, Path]:
    """Return the headers that hold code, each with the file of the tests that uses all of it."""
    found = (
        (path, HERE / f"{path.stem.removeprefix('dcmp_')}_checks.c") for path in sorted(CORE.glob("*.h"))
    )
    return {header: check for header, check in found if check.exists() and check.stem != "core_checks"}


def law_checks(header: Path) -> list[Path]:
    """Return the files of the tests that use all of a header; one type is enough where it has one text."""
    stem = "elementary" if header.stem == "dcmp_real" else header.stem.removeprefix("dcmp_")
    of_both = "DCMP_REAL_FLOAT" in header.read_text("utf-8")
    return [HERE / f"{stem}{kind}_checks.c" for kind in (("", "_float") if of_both else ("",))]


def compile_all(folder: Path, flags: list[str], *more: Path) -> list[Path]:
    """Compile the core and more files, each into an object of its own."""
    objects = []
    for source in [*sources(), *app_sources(), *more]:
        built = folder / f"{source.stem}.o"
        command = [
            compiler(),
            *WARNINGS,
            *LAW,
            *flags,
            "-fPIC",
            f"-I{CORE}",
            f"-I{APP}",
            "-c",
            str(source),
            "-o",
            str(built),
        ]
        subprocess.run(command, check=True, cwd=folder)
        objects.append(built)
    return objects


def build(folder: Path, kind: str) -> Path:
    """Build the library of one kind; return its path."""
    objects = compile_all(folder, BUILDS[kind], *check_sources())
    library = folder / f"libcore_{kind}.so"
    subprocess.run(
        [compiler(), "-shared", *BUILDS[kind], *map(str, objects), "-o", str(library)], check=True, cwd=folder
    )
    return library


@functools.cache
def declarations() -> str:
    """Return every declaration of the core, preprocessed without the system's headers, which cffi knows."""
    folders = [f"-I{folder}" for folder in (CORE, APP, HERE, HERE / "no_headers")]
    command = [compiler(), "-E", "-P", "-nostdinc", "-D_Atomic=", *folders, "-"]  # cffi knows no _Atomic
    text = '#include "core_checks.h"\n#include "app.h"\n#include "boot_count.h"\n#include "law_checks.h"\n'
    text += '#define DCMP_REAL_FLOAT\n#include "law_checks.h"\n'
    return subprocess.run(command, check=True, input=text, capture_output=True, text=True).stdout


@functools.cache
def interface() -> FFI:
    """Return what Python knows of the declarations; to read them takes longer than to load a library."""
    ffi = FFI()
    ffi.cdef(declarations())
    return ffi


def load(library: Path) -> tuple[FFI, Any]:
    """Load a library; its structures are as large here as they are there."""
    ffi = interface()
    lib: Any = ffi.dlopen(str(library))
    assert lib.check_device_size() == ffi.sizeof("struct dcmp_device")
    return ffi, lib
