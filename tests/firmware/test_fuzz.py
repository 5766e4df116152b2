"""The port under mutated streams, with the sanitizers; by libFuzzer too where clang has it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.firmware.core_library import BUILDS, CORE, ROOT, WARNINGS, compiler, sources

FUZZ = ROOT / "firmware" / "fuzz"
EXECUTIONS = 200_000
FLAGS = [flag for flag in WARNINGS if flag != "-ffreestanding"] + ["-D_POSIX_C_SOURCE=200809L", f"-I{CORE}"]


def _build(folder: Path, cc: str, flags: list[str], *files: str) -> Path:
    program = folder / "fuzz"
    named = [str(FUZZ / name) for name in files]
    subprocess.run(
        [cc, *FLAGS, *flags, *named, *map(str, sources()), "-o", str(program)], check=True, cwd=folder
    )
    return program


def test_mutated_streams(tmp_path: Path) -> None:
    program = _build(tmp_path, compiler(), [*BUILDS["sanitized"], "-O2"], "fuzz_main.c", "fuzz_port.c")
    done = subprocess.run([str(program), str(EXECUTIONS), "1"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-4000:]
    print(done.stdout)  # noqa: T201
    ran = re.fullmatch(r"(\d+) executions, (\d+) in RUN, \d+ a second\n", done.stdout)
    assert ran is not None
    assert int(ran[1]) == EXECUTIONS
    assert int(ran[2]) > EXECUTIONS // 10  # else the mutations are too coarse to test what matters


# Each of these is one line of the core made wrong: a fuzzer that does not see it is not worth its time.
SABOTAGE = {
    "voltage outside RUN": ("dcmp_guard.c", "dcmp_amplifier_cut(&device->amplifier);", "(void)device;"),
    "no hash": ("dcmp_receive.c", "hello.protocol_hash != DCMP_PROTOCOL_HASH", "hello.protocol_hash == 0u"),
    "no watchdog": ("dcmp_watchdog.c", "> watchdog->time_us", "> 10000000u + watchdog->time_us"),
    "no clamp": ("dcmp_amplifier.c", "value > high ? high : value", "value > high ? value : value"),
    "buffer": ("dcmp_cobs.c", "cobs->length == sizeof cobs->bytes", "cobs->length == 20u"),
}


@pytest.mark.parametrize("name", SABOTAGE)
def test_the_fuzzer_finds_a_core_made_wrong(tmp_path: Path, name: str) -> None:
    file, right, wrong = SABOTAGE[name]
    copies = []
    for source in [*sources(), *CORE.glob("*.h")]:
        text = source.read_text()
        if source.name == file:
            assert right in text
            text = text.replace(right, wrong)
        (tmp_path / source.name).write_text(text)
        copies += [str(tmp_path / source.name)] if source.suffix == ".c" else []
    program = tmp_path / "fuzz"
    flags = ["-std=c11", "-D_POSIX_C_SOURCE=200809L", f"-I{tmp_path}", *BUILDS["sanitized"]]
    files = [str(FUZZ / "fuzz_main.c"), str(FUZZ / "fuzz_port.c"), *copies]
    subprocess.run([compiler(), *flags, *files, "-o", str(program)], check=True, cwd=tmp_path)
    done = subprocess.run([str(program), "20000", "1"], capture_output=True, check=False)
    assert done.returncode != 0


def test_libfuzzer(tmp_path: Path) -> None:
    """An addition: clang is not needed, but used where it is."""
    clang = shutil.which("clang")
    if clang is None:
        pytest.skip("no clang here: apt install clang (gcc's own driver ran the same target)")
    probe = [clang, "-fsanitize=fuzzer", "-x", "c", "-", "-o", os.devnull]
    target = "int LLVMFuzzerTestOneInput(const unsigned char *d, unsigned long n) { return !d && n; }"
    if subprocess.run(probe, input=target, text=True, capture_output=True, check=False).returncode != 0:
        pytest.skip("clang has no libFuzzer here: apt install libclang-rt-dev")
    flags = ["-O1", "-g", "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all"]
    program = _build(tmp_path, clang, flags, "fuzz_port.c")
    command = [str(program), "-runs=100000", "-seed=1", "-max_len=1024", "-verbosity=0"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr[-4000:]
