"""The law has the same bits from every compiler, level and instruction set, on whole recordings as well."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import run
from dcmp_hil.values import Sample
from tests.firmware.bench import Core
from tests.firmware.core import test_control as control
from tests.firmware.core import test_elementary as elementary
from tests.firmware.core import test_friction_kalman as friction_kalman
from tests.firmware.core_library import CORE, HERE, LAW, WARNINGS, interface, law_headers
from tests.firmware.law import Law, same_bits
from tests.helpers import STEADY, bench
from tests.target.build import needed

if TYPE_CHECKING:
    from collections.abc import Sequence

AVX2 = ("-mavx2", "-mfma")  # with fused instructions, which must not be used
AVX512 = (*AVX2, "-mavx512f", "-mavx512dq", "-mavx512vl", "-mprefer-vector-width=512")
BUILDS = [
    ("gcc", "-O0"),
    ("gcc", "-O2", "-msse4.2"),
    ("gcc", "-O3", *AVX2),
    ("gcc", "-O3", *AVX512),
    ("clang", "-O0"),
    ("clang", "-O3", *AVX2),
    ("clang", "-O3", *AVX512),
]


def _law(folder: Path, name: str, flags: Sequence[str]) -> Law:
    """Build the check files with a compiler and its flags; skip what this processor does not have."""
    here = set(Path("/proc/cpuinfo").read_text("ascii").replace("sse4_2", "sse4.2").split())
    missing = {flag[2:] for flag in flags if flag.startswith("-m") and "=" not in flag} - here
    if missing:
        pytest.skip(f"this processor has no {', '.join(sorted(missing))}")
    files = [str(path) for path in sorted(set(law_headers().values()))]
    library = folder / "law.so"
    options = [*WARNINGS, *LAW, *flags, "-fPIC", "-shared", f"-I{CORE}", f"-I{HERE}"]
    subprocess.run([needed(name), *options, *files, "-o", str(library)], check=True)
    ffi = interface()
    return Law(Core(ffi, ffi.dlopen(str(library))))


@pytest.mark.parametrize("build", BUILDS, ids=" ".join)
def test_every_build_has_the_bits_of_python(tmp_path: Path, build: tuple[str, ...]) -> None:
    law = _law(tmp_path, build[0], build[1:])
    for name, _, given in elementary.CASES:
        assert same_bits(law(name, given), elementary.WANTED[name]), name
    for name, ride in control.RIDES.items():
        assert same_bits(control.r1_in_c(law, *ride), control.WANTED[name]), name
    for name, filtered in friction_kalman.RIDES.items():
        assert same_bits(friction_kalman.in_c(law, *filtered), friction_kalman.WANTED[name]), name


def test_loops_over_lanes_become_vectors(tmp_path: Path) -> None:
    """Every column of elementary functions, by gcc, whose vectoriser asks more of a loop than clang's."""
    (tmp_path / "columns.c").write_text((HERE / "elementary_checks.c").read_text())
    options = [*WARNINGS, *LAW, "-O3", "-fopt-info-vec", f"-I{CORE}", f"-I{HERE}", "-c", "columns.c"]
    if "avx2" in Path("/proc/cpuinfo").read_text("ascii"):
        options.append("-mavx2")
    said = subprocess.run(
        [needed("gcc"), *options, "-o", "columns.o"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert said.stderr.count("loop vectorized") >= len(elementary.CASES)


def test_a_whole_run_has_the_bits_of_its_recording(core: Core) -> None:
    columns = run(bench(*STEADY), duration=30.13, fast=True).columns
    names = ("time_s", "position_rad", "voltage_applied_V")
    samples = [Sample(*row) for row in zip(*(columns[name].tolist() for name in names), strict=True)]
    law, settings = Law(core), friction_kalman.Settings()
    found = ("position_estimate_rad", "velocity_estimate_rad_s", "disturbance_estimate_rad_s2")
    got = control.r1_in_c(law, samples, control.RIG, control.Gains())
    assert same_bits(got, np.column_stack([columns[name] for name in found]))
    assert same_bits(
        friction_kalman.in_c(law, samples, settings), friction_kalman.in_python(samples, settings)
    )
