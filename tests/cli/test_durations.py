"""Every option that is a time takes a unit, as the times of `--fault` do."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from typer.main import get_command

from dcmp_hil.cli import app

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.cli.conftest import Outcome
    from tests.installed import Finished

REST = {"replay": ("nope.csv",)}
"""What a command needs beside its options."""


def times() -> list[tuple[str, str]]:
    """Return every option of every command that is a time."""
    commands = get_command(app).commands  # type: ignore[attr-defined]
    return [
        (name, option.opts[0])
        for name, command in commands.items()
        for option in command.params
        if option.opts[0] in {"--duration", "--from", "--wait", "--period"}
    ]


def test_options_that_are_a_time_are_found() -> None:
    assert {("run", "--duration"), ("run", "--from"), ("monitor", "--duration"), ("ports", "--wait")} < {
        *times()
    }


@pytest.mark.parametrize(("command", "option"), times())
def test_a_time_with_an_unknown_unit_is_refused_with_a_remedy(
    cli: Callable[..., Outcome], command: str, option: str
) -> None:
    outcome = cli(command, *REST.get(command, ()), option, "10x")
    assert outcome.code == 2
    assert outcome.err == (
        f'error: {option}: got "10x"; expected a time such as 3s, 200ms or 2min; a plain number is in s.\n'
    )


@pytest.mark.parametrize("wait", ["5ms", "2min", "-1s"])
def test_a_wait_out_of_range_is_refused(cli: Callable[..., Outcome], wait: str) -> None:
    outcome = cli("ports", "--wait", wait)
    assert (outcome.code, outcome.out) == (2, "")
    assert "expected 100ms to 60s" in outcome.err


def test_run_takes_times_with_a_unit(script: Callable[..., Finished]) -> None:
    done = script("run", "--fast", "--no-record", "--duration", "900ms", "--from", "0.0095min", "--json", "-")
    assert done.code == 0, done.err
    figures = json.loads(done.out)
    assert figures["window_s"] == pytest.approx([0.57, 0.9])
    assert figures["periods"] == 330
