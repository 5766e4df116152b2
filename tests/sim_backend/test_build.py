"""Compiling the firmware for this computer: once for all processes, and with a remedy where it fails."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dcmp_hil.errors import OpenError
from sim_backend.board import build
from sim_backend.compiling.build import sources
from tests.firmware.core_library import WARNINGS, compiler

pytestmark = pytest.mark.usefixtures("needs_compiler")


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return sources that take no time, and a cache of their own."""
    root = tmp_path / "firmware"
    for name, text in (
        ("core/number.h", "int number(void);"),
        ("core/number.c", '#include "number.h"\nint number(void) { return 7; }'),
        ("boards/native/main.c", '#include "number.h"\nint main(void) { return number(); }'),
        (
            "boards/hostlib/lib.c",
            '#include "number.h"\nint twice(void);\nint twice(void) { return 2 * number(); }',
        ),
    ):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text + "\n")
    monkeypatch.setattr("sim_backend.compiling.build._SOURCE_FOLDERS", (tmp_path / "nowhere", root))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return root


@pytest.mark.usefixtures("tree")
def test_what_was_compiled_is_kept(tmp_path: Path) -> None:
    program, library = build.program(), build.library()
    assert subprocess.run([program], check=False).returncode == 7
    assert program.is_relative_to(tmp_path / "cache" / "dcmp-hil")
    made = [path.stat().st_mtime_ns for path in (program, library)]
    assert (build.program(), build.library()) == (program, library)
    assert [path.stat().st_mtime_ns for path in (program, library)] == made
    assert sorted(path.name for path in (tmp_path / "cache").rglob("*") if path.is_file()) == [
        program.name,
        library.name,
    ]


def test_changed_source_header_or_compiler_is_compiled_anew(
    tree: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = [build.program()]
    (tree / "core" / "number.c").write_text('#include "number.h"\nint number(void) { return 8; }\n')
    found.append(build.program())
    assert subprocess.run([found[-1]], check=False).returncode == 8
    (tree / "core" / "number.h").write_text("int number(void); /* other words */\n")
    found.append(build.program())
    monkeypatch.setenv("CC", f"{compiler()} -DANOTHER")
    found.append(build.program())
    assert len(set(found)) == 4


def test_two_processes_at_once_get_one_whole_program_each(tree: Path) -> None:
    code = (
        "import pathlib\nfrom sim_backend.board import build\n"
        "from sim_backend.compiling import build as compiling\n"
        f"compiling._SOURCE_FOLDERS = (pathlib.Path({str(tree)!r}),)\n"
        "print(build.program())"
    )
    running = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) for _ in range(3)
    ]
    paths = {process.communicate(timeout=60)[0].strip() for process in running}
    assert len(paths) == 1
    program = Path(paths.pop())
    assert subprocess.run([program], check=False).returncode == 7
    assert list(program.parent.iterdir()) == [program]


def complaint() -> str:
    """Return what is said when compiling fails: one line, exit code 3."""
    with pytest.raises(OpenError) as caught:
        build.library()
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 3
    return str(caught.value)


@pytest.mark.usefixtures("tree")
def test_missing_compiler_is_named_with_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "apt install gcc" in complaint()


@pytest.mark.usefixtures("tree")
def test_compiler_of_the_environment_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "/no/such/cc -m64")
    said = complaint()
    assert "/no/such/cc" in said
    assert "CC" in said


@pytest.mark.usefixtures("tree")
def test_compiler_of_the_environment_that_is_no_command_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", '"')
    assert "CC" in complaint()


def script(folder: Path, text: str) -> str:
    """Make a compiler of a few lines of Python."""
    path = folder / "compiler"
    path.write_text(f"#!{sys.executable}\nimport os, signal\n{text}\n")
    path.chmod(0o755)
    return str(path)


@pytest.mark.usefixtures("tree")
def test_compiler_that_was_interrupted_is_no_fault_of_the_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", script(tmp_path, "os.kill(os.getpid(), signal.SIGTERM)"))
    said = complaint()
    assert "interrupted" in said
    assert "does not compile" not in said


@pytest.mark.usefixtures("tree")
def test_ctrl_c_does_not_reach_the_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = tmp_path / "told"
    monkeypatch.setenv(
        "CC", script(tmp_path, f"open({str(told)!r}, 'w').write(str(os.getsid(0)))\nraise SystemExit(1)")
    )
    complaint()
    assert int(told.read_text()) != os.getsid(0)


def test_source_that_does_not_compile_shows_its_first_error(tree: Path) -> None:
    (tree / "core" / "number.c").write_text("int number(void) { return nothing; }\n#error later\n")
    assert "nothing" in complaint()


@pytest.mark.usefixtures("tree")
def test_cache_that_cannot_be_written_is_named_with_its_variable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert "XDG_CACHE_HOME" in complaint()


def test_sources_that_were_not_installed_are_missed(tree: Path) -> None:
    shutil.rmtree(tree)
    assert "Install dcmp-hil again" in complaint()


def test_library_that_cannot_be_loaded_is_named(tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sim_backend.board import hostlib

    broken = tree / "broken.so"
    broken.write_text("no library")
    monkeypatch.setattr("sim_backend.board.build.library", lambda: broken)
    with pytest.raises(OpenError, match=r"broken\.so: cannot be loaded .* Delete"):
        hostlib.load.__wrapped__()


@pytest.mark.parametrize(("board", "flags"), [("hostlib", ["-fPIC"]), ("native", ["-D_XOPEN_SOURCE=700"])])
def test_boards_compile_without_a_warning(tmp_path: Path, board: str, flags: list[str]) -> None:
    root = sources()
    warnings = [flag for flag in WARNINGS if flag != "-ffreestanding"]
    for source in sorted(root.glob(f"boards/{board}/*.c")):
        command = [compiler(), *warnings, *flags, "-O2", f"-I{root / 'core'}", "-c", str(source)]
        subprocess.run([*command, "-o", str(tmp_path / "made.o")], check=True)
