"""`dcmp-hil run --fault`: what a user sees and with which code it ends."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from sim_backend.faults.host import InjectedBaseError, InjectedError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.cli.conftest import Outcome

    Cli = Callable[..., Outcome]

QUICK = ("run", "--fast", "--no-record", "--set", "backend.kind=sim-board")


@pytest.mark.parametrize(
    ("arguments", "code", "says"),
    [
        (("--fault", "wire.drop:p=0.05,at=1s,for=0.2s"), 0, ""),
        (("--fault", "plant.power:at=1.2s"), 4, "as if the motor had no current"),
        (("--fault", "wire.hold:way=up,at=1s"), 4, "heard no valid command"),
        (("--fault", "firmware.stop:at=1s"), 4, "STOP was sent to the device"),
        (("--fault", "firmware.reset:at=1s"), 4, "left RUN by itself"),
        (("--fault", "wire.blackhole:way=down,at=1s"), 3, "no sample for 20 ms"),
        (("--fault", "firmware.version:at=boot"), 3, "speaks protocol"),
        (("--fault", "wire.garble:at=boot"), 3, "baud"),
        (("--fault", "host.slow:at=1s", "--set", "timing.overrun=stop"), 5, "were late"),
        (("--fault", "wire.drp", "--fault", "wire.drop:q=1"), 2, 'Did you mean "wire.drop"?'),
    ],
)
def test_run_with_a_fault_ends_with_its_exit_code(
    cli: Cli, arguments: tuple[str, ...], code: int, says: str
) -> None:
    outcome = cli(*QUICK, "--duration", "1.5", *arguments)
    assert outcome.code == code, outcome.err
    assert says in outcome.err.replace("\n", " ")


@pytest.mark.parametrize(("what", "error"), [("exception", InjectedError), ("base", InjectedBaseError)])
def test_a_bug_in_a_controller_is_shown_as_such(cli: Cli, what: str, error: type[BaseException]) -> None:
    with pytest.raises(error, match="injected: controller"):
        cli(*QUICK, "--duration", "1.5", "--fault", f"host.raise:what={what},at=1s")


def test_a_run_keeps_what_went_wrong_on_purpose(cli: Cli, tmp_path: Path) -> None:
    cli("run", "--fast", "--duration", "1", "--fault", "plant.offset:V=0.1,at=0.5s")
    (folder,) = (tmp_path / "runs").iterdir()
    assert json.loads((folder / "summary.json").read_text())["faults"] == ["plant.offset:V=0.1,at=0.5s"]


@pytest.mark.parametrize(
    ("fault", "told"), [("host.diverge:at=0.5s,for=5ms", True), ("plant.offset:V=0.1,at=0.5s", False)]
)
def test_replay_says_that_faults_of_the_host_are_not_made_again(
    cli: Cli, tmp_path: Path, fault: str, told: bool
) -> None:
    cli("run", "--fast", "--duration", "0.7", "--fault", fault)
    (folder,) = (tmp_path / "runs").iterdir()
    again = cli("replay", str(folder))
    assert ("had faults of the host on purpose" in " ".join(again.err.split())) == told
    assert ("the numbers differ" in " ".join(again.out.split())) == told


def test_a_fault_of_the_wire_brings_its_wire_along(cli: Cli) -> None:
    outcome = cli(
        "run", "bench-1khz", "--fast", "--no-record", "--duration", "1.5", "--fault", "wire.hold:way=up,at=1s"
    )
    assert "this run has backend.kind=sim-board" in outcome.err.replace("\n", " ")
    assert outcome.code == 4
    assert "heard no valid command" in outcome.err.replace("\n", " ")


def test_both_mistakes_of_a_command_line_are_told_at_once(cli: Cli) -> None:
    outcome = cli(*QUICK, "--fault", "wire.drp", "--fault", "plant.power:at=never")
    assert outcome.err.count("error: --fault") == 2
