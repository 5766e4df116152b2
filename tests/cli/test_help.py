"""The help and the words of a wrong command line, as a user at 80 columns sees them."""

from __future__ import annotations

import re
import shlex
from typing import TYPE_CHECKING

import pytest
from typer.main import get_command

from dcmp_hil.cli import app
from dcmp_hil.cli.help_texts import HELP
from dcmp_hil.config import shipped_rigs
from tests.walk.streams import TERMINAL, call

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.cli.conftest import Outcome

COLUMNS = 80
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]
EXAMPLES = [(name, example) for name, texts in HELP.items() for example in texts.examples]
WRONG = ("run", "--fast", "--set", "loop.rate_hz=0", "--set", "amplifier.voltage_limit_mV=5000")


@pytest.fixture(autouse=True)
def _width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(COLUMNS))


def test_every_command_is_listed_in_a_group_by_one_line(cli: Callable[..., Outcome]) -> None:
    outcome = cli("--help")
    assert outcome.code == 0
    assert list(HELP) == list(COMMANDS)
    heading, listed = "", {}
    for line in outcome.out.splitlines():
        if found := re.match(r"╭─ (.+?) ─+╮$", line):
            heading = found[1]
        elif found := re.match(r"│ (\w+) +(\S.*?) *│$", line):
            listed[found[1]] = (heading, found[2])
    assert listed == {name: (texts.group, texts.summary) for name, texts in HELP.items()}


def test_no_command_is_the_help_and_exit_code_2(cli: Callable[..., Outcome]) -> None:
    outcome = cli()
    assert (outcome.code, outcome.err) == (2, "")
    assert outcome.out.strip() == cli("--help").out.strip() != ""


@pytest.mark.parametrize("command", [*COMMANDS])
def test_help_at_80_columns_breaks_no_word_and_leaves_none_out(
    cli: Callable[..., Outcome], command: str
) -> None:
    shown = cli(command, "--help").out
    assert max(map(len, shown.splitlines())) <= COLUMNS
    words = {*shown.replace("│", " ").split()}
    texts = [COMMANDS[command].help, *(one.help for one in COMMANDS[command].params)]
    missing = {word for text in texts for word in text.replace(r"\[", "[").split()} - words
    assert not missing
    for option in COMMANDS[command].params:
        assert {*option.opts} <= {*re.split(r"[ ,]+", shown)} or not option.opts[0].startswith("-")
    for example in HELP[command].examples:
        assert example in shown


@pytest.mark.parametrize(("command", "example"), EXAMPLES)
def test_an_example_is_a_command_line_that_is_taken(command: str, example: str) -> None:
    program, name, *arguments = shlex.split(example)
    assert (program, name) == ("dcmp-hil", command)
    context = COMMANDS[command].make_context(name, arguments)
    rig = context.params.get("rig")
    assert rig is None or rig.endswith(".toml") or rig in shipped_rigs()


@pytest.mark.parametrize(
    "example", [text for _, text in EXAMPLES if re.search(r"check bench|rigs|--list", text)]
)
def test_an_example_without_a_device_runs(cli: Callable[..., Outcome], example: str) -> None:
    assert cli(*shlex.split(example)[1:]).code == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("rnu",), '"rnu" is no command. Did you mean "run"?'),
        (("replya", "x.csv"), '"replya" is no command. Did you mean "replay"?'),
        (("xyzzy",), '"xyzzy" is no command. The commands: run, check, sweep, rigs, '),
        (("run", "--durration", "3"), "No such option: --durration. Did you mean --duration?"),
        (("run", "--xyzzy"), "No such option: --xyzzy. See `dcmp-hil run --help`."),
        (("run", "--viewer", "wbe"), "Invalid value for '--viewer': 'wbe' is not one of 'spawn', 'web', "),
        (("run", "--duration"), "Option '--duration' requires an argument."),
        (("check", "bench-1khz", "paper"), "Got unexpected extra argument(s) (paper)."),
        (("completion",), "Missing argument 'SHELL'. Choose from: bash, zsh, fish. See "),
        (("completion", "bash", "--shell"), "No such option: --shell. Did you mean --help?"),
        (("replay",), "Missing argument 'FILE'. See `dcmp-hil replay --help`."),
    ],
)
def test_a_wrong_command_line_is_one_sentence_and_what_was_meant(
    cli: Callable[..., Outcome], arguments: tuple[str, ...], says: str
) -> None:
    outcome = cli(*arguments)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith(f"error: {says}"), outcome.err
    assert outcome.err.count("\n") == 1


@pytest.mark.parametrize("arguments", [WRONG, ("rigs",), ("conform", "--list")])
def test_a_line_on_a_terminal_is_broken_between_words(
    installed: Path, cli: Callable[..., Outcome], tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    outcome = cli(*arguments)
    plain = outcome.err + outcome.out
    assert max(map(len, plain.splitlines())) > COLUMNS
    shown = call([str(installed), *arguments], TERMINAL, tmp_path, {"COLUMNS": None, "NO_COLOR": "1"})
    lines = re.sub(r"\x1b\[[\d;]*m", "", shown.err).split("\r\n")
    assert shown.code == outcome.code
    assert " ".join(lines).split() == plain.split()
    assert max(map(len, lines)) <= COLUMNS


@pytest.mark.parametrize("arguments", [("--help",), ("rnu",)])
def test_a_terminal_gets_colours_unless_no_color_is_set(
    installed: Path, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    colour = re.compile(r"\x1b\[(?:\d+;)*(?:3[0-7]|9[0-7]|38;[\d;]+)m")
    without = call([str(installed), *arguments], TERMINAL, tmp_path, {"NO_COLOR": "1"})
    assert not colour.search(without.err)
    assert colour.search(call([str(installed), *arguments], TERMINAL, tmp_path, {"NO_COLOR": None}).err)
