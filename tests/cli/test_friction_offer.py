"""Friction that the observer found: offered at the end of a run, and written where the user says so."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from dcmp_hil import load_rig

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.cli.conftest import Outcome
    from tests.installed import Finished

    Cli = Callable[..., Outcome]
    Script = Callable[..., Finished]

_RUN = (
    *("--fast", "--duration", "8s", "--from", "3s", "--viewer", "none", "--no-record"),
    *("--set", "observer.kind=friction_kalman"),
)
_WRONG = ("--set", "sim.plant.f1_rad_s2=1.6")


def test_friction_found_is_offered_as_a_diff_and_its_command_writes_it(
    script: Script, tmp_path: Path
) -> None:
    assert script("rigs", "--copy", "bench-1khz", "mine.toml").code == 0
    before = (tmp_path / "mine.toml").read_text().splitlines()
    done = script("run", "mine.toml", *_RUN, *_WRONG, "--json", "figures.json")
    assert done.code == 0
    assert (tmp_path / "mine.toml").read_text().splitlines() == before  # nothing is written unasked
    offered = json.loads((tmp_path / "figures.json").read_text())["friction"]["offered_rad_s2"]
    assert 1.5 < offered < 1.7
    assert f"+f1_rad_s2 = {offered:g} " in done.err
    (line,) = [line for line in done.err.splitlines() if "to write it: " in line]
    command = line.partition("to write it: ")[2].split()
    assert command == ["dcmp-hil", "check", "mine.toml", "--set", f"model.f1_rad_s2={offered:g}", "--write"]
    assert script(*command[1:]).code == 0
    after = (tmp_path / "mine.toml").read_text().splitlines()
    (changed,) = [k for k, (old, new) in enumerate(zip(before, after, strict=True)) if old != new]
    assert after[changed].startswith(f"f1_rad_s2 = {offered:g} ")
    assert after[changed].partition("#")[2] == before[changed].partition("#")[2]
    assert load_rig(str(tmp_path / "mine.toml")).model.f1_rad_s2 == offered


def test_a_shipped_rig_has_no_file_and_is_offered_a_command(cli: Cli) -> None:
    done = cli("run", "bench-1khz", *_RUN, *_WRONG)
    assert done.code == 0
    assert "to use it: dcmp-hil run bench-1khz --set model.f1_rad_s2=1." in done.err
    assert "friction  " in done.out
    assert "(model 1.3)" in done.out
    assert "let go of the model " in done.out


def test_nothing_is_offered_where_the_model_is_right_or_no_observer_finds_friction(cli: Cli) -> None:
    right = cli("run", *_RUN, "--json", "-")
    assert "the observer found" not in right.err
    assert json.loads(right.out)["friction"]["offered_rad_s2"] is None
    other = cli("run", *_RUN[:-1], "observer.kind=super_twisting", *_WRONG, "--json", "-")
    assert "the observer found" not in other.err
    assert json.loads(other.out)["friction"] is None


def test_check_writes_what_it_checked_and_shows_the_difference(cli: Cli, tmp_path: Path) -> None:
    cli("rigs", "--copy", "bench-1khz", "mine.toml")
    done = cli("check", "mine.toml", "--set", "loop.rate_hz=500", "--write")
    assert done.code == 0
    assert "-rate_hz = 1000" in done.out
    assert "+rate_hz = 500" in done.out
    assert load_rig(str(tmp_path / "mine.toml")).loop.rate_hz == 500
    again = cli("check", "mine.toml", "--set", "loop.rate_hz=500", "--write")
    assert (again.code, again.out) == (0, "")
    assert "says so already" in again.err


def test_check_writes_nothing_that_breaks_a_rule_or_has_no_file(cli: Cli, tmp_path: Path) -> None:
    cli("rigs", "--copy", "bench-1khz", "mine.toml")
    before = (tmp_path / "mine.toml").read_bytes()
    for arguments, said in (
        (("mine.toml", "--set", "loop.rate_hz=-1", "--write"), "loop.rate_hz"),
        (("mine.toml", "--write"), "nothing to write"),
        (("bench-1khz", "--set", "loop.rate_hz=500", "--write"), "dcmp-hil rigs --copy bench-1khz my.toml"),
    ):
        done = cli("check", *arguments)
        assert done.code == 2
        assert said in done.err
    assert (tmp_path / "mine.toml").read_bytes() == before


def test_the_difference_is_shown_as_the_file_has_it(script: Script, tmp_path: Path) -> None:
    comment = f"# :smile: [red] {'word ' * 50}END"
    (tmp_path / "mine.toml").write_text(f"[model]\nf1_rad_s2 = 1.3 {comment}\n")
    done = script("check", "mine.toml", "--set", "model.f1_rad_s2=1.5", "--write")
    assert f"+f1_rad_s2 = 1.5 {comment}" in done.out.splitlines()
