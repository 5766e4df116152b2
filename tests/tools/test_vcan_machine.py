"""The machine with CAN, without starting it: what is in it, how it ends, what happens where there is none."""

from __future__ import annotations

import lzma
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tools.vcan_machine.debian import in_order
from tools.vcan_machine.initramfs import SCRIPT, initramfs
from tools.vcan_machine.machine import CONSOLE, INSTALL, QEMU, missing, place, run

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]


@pytest.fixture
def modules(tmp_path: Path) -> dict[str, Path]:
    needs = {
        "can-raw.ko": "can",
        "can.ko.xz": "",
        "vcan.ko": "can-dev,built-in",
        "can-dev.ko": "",
        "can-gw.ko": "can",
    }
    for name, others in needs.items():
        module = f"\x7fELF\0license=GPL\0depends={others}\0name=\0".encode()
        (tmp_path / name).write_bytes(lzma.compress(module) if name.endswith(".xz") else module)
    return {name.partition(".")[0].replace("-", "_"): tmp_path / name for name in needs}


@pytest.fixture
def share(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put a machine into a cache of our own, and a folder for QEMUs that are none into the path."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{os.environ['PATH']}")
    for folder in (place().kernel.parent, tmp_path / "bin", tmp_path / "sha,re"):
        folder.mkdir(parents=True)
    place().initramfs.touch()
    return tmp_path / "sha,re"


def pass_for_qemu(share: Path, script: str) -> None:
    program = share.parent / "bin" / QEMU
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)


def pytest_here(**settings: str) -> str:
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:cov", "tests/socketcan"]
    environment = {name: value for name, value in os.environ.items() if name != "CI"} | settings
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    return done.stdout


def entries(archive: bytes) -> Iterator[tuple[str, int, bytes]]:
    at = 0
    while at < len(archive):
        assert archive[at : at + 6] == b"070701"
        fields = [int(archive[at + 6 + 8 * n : at + 14 + 8 * n], 16) for n in range(13)]
        name = archive[at + 110 : at + 110 + fields[11]]
        at += -(-(110 + fields[11]) // 4) * 4
        yield name.rstrip(b"\0").decode(), fields[1], archive[at : at + fields[6]]
        at += -(-fields[6] // 4) * 4


def test_modules_come_after_what_they_need_and_once(modules: dict[str, Path]) -> None:
    ordered = in_order(("can_raw", "vcan", "can", "built_in"), modules)
    assert list(ordered) == ["can", "can_raw", "can_dev", "vcan"]
    assert all(module.startswith(b"\x7fELF") for module in ordered.values())


def test_initramfs_holds_what_it_is_made_of() -> None:
    archive = initramfs(b"busybox", {"can": b"1", "can_raw": b"23"})
    found = {name: (mode, data) for name, mode, data in entries(archive)}
    assert list(found)[-1] == "TRAILER!!!"
    assert found["bin/busybox"] == (0o100755, b"busybox")
    assert found["modules/order"][1] == b"can\ncan_raw\n"
    assert found["modules/can_raw"][1] == b"23"
    assert found["init"][0] == 0o100755


def test_command_that_gets_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert missing().startswith(f"no {QEMU}, ip, ")
    assert missing().endswith(f": {INSTALL}")


def test_exit_code_and_console_of_the_command_come_back(share: Path, tmp_path: Path) -> None:
    pass_for_qemu(share, f"echo booted; printf '%s ' \"$@\"; echo 3 >'{share}/status'")
    assert run(["a program", "its=argument"], share, folder=tmp_path, settings={"NAME": "a value"}) == 3
    script = (share / SCRIPT).read_text()
    assert "export NAME='a value'\n" in script
    assert script.endswith("exec 'a program' its=argument\n")
    said = (share / CONSOLE).read_text()
    assert said.startswith("booted")
    assert "path=/,security_model=none,readonly=on" in said
    assert str(share).replace(",", ",,") in said


def test_machine_that_stops_before_its_command_did_is_an_error_with_its_last_words(share: Path) -> None:
    (share / "status").write_text("0")  # of an earlier one
    pass_for_qemu(share, "echo Kernel panic")
    with pytest.raises(RuntimeError, match="Kernel panic"):
        run(["true"], share, folder=share, settings={})


@pytest.mark.parametrize(("settings", "expected"), [({}, "skipped"), ({"CI": "true"}, "errors")])
def test_tests_of_socketcan_say_what_is_missing(
    settings: dict[str, str], expected: str, tmp_path: Path
) -> None:
    said = pytest_here(PATH=str(tmp_path), **settings)
    last = said.splitlines()[-1]
    assert INSTALL in said
    assert expected in last
    assert "passed" not in last
    assert ("skipped" in last) == (expected == "skipped")
