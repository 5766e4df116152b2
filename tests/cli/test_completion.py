"""Completion by the shells themselves: commands, options, keys of `--set`, kinds, rigs, faults, files."""

from __future__ import annotations

import os
import pty
import select
import shutil
import subprocess
import time
from typing import TYPE_CHECKING

import pytest
from typer.main import get_command

from dcmp_hil.cli import app
from dcmp_hil.config import load_rig, shipped_rigs
from dcmp_hil.config.explain import explain
from dcmp_hil.config.rig import KINDS as TABLES
from dcmp_hil.conformance.registry import CHECKS
from dcmp_hil.live.tunables import settable
from sim_backend.faults.fault_spec import KINDS, FaultSpec
from tests.installed import environment

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

SHELLS = ("bash", "zsh", "fish")
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]
_OBSERVERS = [kind for kind in TABLES["observer"] if kind != "custom"]
TIMEOUT_S = 120.0
ASK_BASH = """
. "$0"
COMP_LINE=$1 COMP_POINT=${#1} COMP_WORDBREAKS=$' \\t\\n"\\'><=;|&(:'
_dcmp_hil
printf '%s\\n' "${COMPREPLY[@]}"
"""
TYPED = (
    ("run --set observer.kind=pa\t", "<run><--set><observer.kind=paper>"),
    ("run --fault wire.dr\t:p=0.2,a\t3s", "<run><--fault><wire.drop:p=0.2,at=3s>"),
    ("run --set loop.ra\t500 --no-c\t", "<run><--set><loop.rate_hz=500><--no-control>"),
    ("replay own.toml --compare ext\t,der\t", "<replay><own.toml><--compare><extended_state,derivative>"),
    ("check bench-1\t", "<check><bench-1khz>"),
    ("run own\t", "<run><own.toml>"),
)
"""What is typed behind `dcmp-hil`, and the words that it becomes."""


@pytest.fixture(scope="module")
def scripts(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The scripts that the installed command prints, by shell."""
    folder = tmp_path_factory.mktemp("scripts")
    for shell in SHELLS:
        with (folder / shell).open("w") as file:
            subprocess.run(
                [installed, "completion", shell],
                env=environment(),
                stdout=file,
                timeout=TIMEOUT_S,
                check=True,
            )
    return {shell: folder / shell for shell in SHELLS}


@pytest.fixture
def ask(scripts: dict[str, Path], tmp_path: Path) -> Callable[[str], list[str]]:
    """Return what bash makes of a line and TAB, in a shell that finds no program to start."""
    bash = shutil.which("bash")
    assert bash is not None
    (tmp_path / "own.toml").touch()
    (tmp_path / "data.csv").touch()
    (tmp_path / "folder").mkdir()

    def asked(line: str) -> list[str]:
        done = subprocess.run(
            [bash, "--norc", "--noprofile", "-c", ASK_BASH, scripts["bash"], f"dcmp-hil {line}"],
            env={"PATH": "/nonexistent"},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=True,
        )
        assert done.stderr == ""
        return done.stdout.split()

    return asked


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("re", ["replay"]),
        ("-", ["--version", "--help", "-h"]),
        ("run --no-", ["--no-record", "--no-control"]),
        ("run --viewer ", ["spawn", "web", "serve", "connect", "none"]),
        ("run --viewer=s", ["spawn", "serve"]),
        ("run --fast --duration ", []),
        ("run --set loop.", ["loop.rate_hz=", "loop.delay_samples="]),
        ("run --set observer.kind=", _OBSERVERS),
        ("run --set=observer.kind=p", ["paper"]),
        ("run --set observer.kind=paper --set timing.overrun=", ["hold", "skip", "stop"]),
        ("run --note stop --j", ["--json"]),
        ("run --fault wire.d", ["wire.drop", "wire.dup", "wire.delay"]),
        ("run --fault wire.drop:", ["p=", "burst=", "way=", "at=", "for="]),
        ("run --fault wire.drop:p=0.2,a", ["0.2,at="]),
        ("set controller.k", ["controller.kind=", "controller.kp_1_s2=", "controller.kd_1_s="]),
        ("set --run 4711 observer.M", ["observer.M_rad_s3="]),
        ("check ", [*shipped_rigs(), "own.toml", "folder"]),
        ("run --json d", ["data.csv"]),
        ("replay ", ["data.csv", "folder", "own.toml"]),
        ("replay --observer ", _OBSERVERS),
        ("replay data.csv --compare model.k", ["model.ku_rad_s2_V="]),
        ("replay data.csv --compare supervisor", []),
        ("replay data.csv --compare fr", ["friction_kalman"]),
        ("replay data.csv --compare kalman,", [f"kalman,{kind}" for kind in _OBSERVERS]),
        ("replay data.csv --compare kalman,paper,der", ["kalman,paper,derivative"]),
        ("conform --link ", ["cobs", "slcan", "can"]),
        ("completion ", [*SHELLS]),
        ("nonsense ", []),
    ],
)
def test_bash_completes(ask: Callable[[str], list[str]], line: str, words: list[str]) -> None:
    assert sorted(ask(line)) == sorted(words)


def test_commands_options_and_lists_are_complete(ask: Callable[[str], list[str]]) -> None:
    assert ask("") == [*COMMANDS]
    assert ask("conform --only ") == [check.name for check in CHECKS]
    for name, command in COMMANDS.items():
        options = [text for one in command.params for text in one.opts if text.startswith("-")]
        assert ask(f"{name} -") == [*options, "--help", "-h"]


def test_every_key_of_every_shipped_rig_is_completed(ask: Callable[[str], list[str]]) -> None:
    words = {*ask("run --set ")}
    for rig in map(load_rig, shipped_rigs()):
        assert {f"{key}=" for key, _, _ in explain(rig) if "." in key} <= words
        assert {f"{key}=" for key in settable(rig)} <= {*ask("set ")} < words


def test_every_kind_of_fault_is_completed(ask: Callable[[str], list[str]]) -> None:
    kinds = ask("run --fault ")
    assert kinds == [*KINDS]
    for kind in ("wire.hold", "plant.shove"):
        usual = {"at": 1.0, "for": 1.0, **FaultSpec(kind).params}
        keys = ask(f"run --fault {kind}:")
        assert keys == [f"{key}=" for key in (*FaultSpec(kind).params, "at", "for")]
        FaultSpec.of(f"{kind}:" + ",".join(f"{key}{usual[key[:-1]]}" for key in keys))


def _needed(shell: str) -> None:
    """Skip without a shell, saying how to get it; under CI that is a failure."""
    if shutil.which(shell):
        return
    sentence = f"no {shell}: apt-get install --no-install-recommends {shell}"
    if os.environ.get("CI") == "true":
        pytest.fail(sentence)
    pytest.skip(sentence)


@pytest.mark.parametrize(("typed", "became"), TYPED)
def test_bash_at_a_terminal(scripts: dict[str, Path], tmp_path: Path, typed: str, became: str) -> None:
    ready = f"source '{scripts['bash']}'\n"
    assert became in _at_a_terminal(["bash", "--norc", "--noprofile", "-i"], ready, typed, tmp_path)


@pytest.mark.parametrize(("typed", "became"), TYPED)
def test_zsh_at_a_terminal(scripts: dict[str, Path], tmp_path: Path, typed: str, became: str) -> None:
    _needed("zsh")
    ready = f"autoload -Uz compinit; compinit -u -D; source '{scripts['zsh']}'\n"
    assert became in _at_a_terminal(["zsh", "-f", "-i"], ready, typed, tmp_path)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("re", {"replay"}),
        ("run --viewer=s", {"--viewer=spawn", "--viewer=serve"}),
        ("run --set loop.", {"loop.rate_hz=", "loop.delay_samples="}),
        ("run --set observer.kind=p", {"observer.kind=paper"}),
        ("run --fault wire.drop:p=0.2,a", {"wire.drop:p=0.2,at="}),
        ("run --fault wire.d", {"wire.drop", "wire.dup", "wire.delay"}),
        ("check bench-", {"bench-1khz", "bench-can", "bench-serial"}),
        ("run --duration ", set[str]()),
    ],
)
def test_fish_completes(scripts: dict[str, Path], tmp_path: Path, line: str, words: set[str]) -> None:
    _needed("fish")
    done = subprocess.run(
        ["fish", "--no-config", "-c", f"source '{scripts['fish']}'; complete -C 'dcmp-hil {line}'"],
        env=environment(HOME=str(tmp_path)),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=True,
    )
    assert {text.partition("\t")[0] for text in done.stdout.splitlines()} == words, done.stderr


def _at_a_terminal(command: list[str], ready: str, typed: str, folder: Path) -> str:
    """Type a command line and Enter into a shell on a pseudo terminal; return what is on the screen then."""
    (folder / "own.toml").touch()
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        command,
        env=environment(TERM="dumb", HOME=str(folder), PS1="> "),
        cwd=folder,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
    ) as process:
        os.close(theirs)
        try:
            os.write(ours, b"dcmp-hil() { printf '<%s>' \"$@\"; echo; }\n" + ready.encode())
            os.write(ours, b"echo ready-$((40 + 2))\n")
            shown = _until(ours, "ready-42")
            os.write(ours, f"dcmp-hil {typed}\necho ended-$((40 + 2))\n".encode())
            return shown + _until(ours, "ended-42")
        finally:
            process.kill()
            os.close(ours)


def _until(terminal: int, mark: str) -> str:
    shown, end = "", time.monotonic() + TIMEOUT_S
    while mark not in shown:
        assert time.monotonic() < end, shown
        if select.select([terminal], [], [], 0.5)[0]:
            shown += os.read(terminal, 65536).decode("utf-8", "replace")
    return shown
