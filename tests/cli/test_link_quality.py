"""What a line does to a run is told in the summary, in `--json` and by a warning, with its cause."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.cli.conftest import Outcome
    from tests.installed import Finished

    Run = Callable[..., Finished | Outcome]

pytestmark = pytest.mark.usefixtures("needs_compiler")

BOARD = "backend.kind=sim-board"


def fly(
    run: Run,
    folder: Path,
    *faults: str,
    sets: tuple[str, ...] = (),
    options: tuple[str, ...] = ("--no-record",),
    seconds: float = 2,
) -> tuple[Any, dict[str, Any]]:
    """Run some seconds in virtual time; return what was printed, and the figures."""
    words = [word for fault in faults for word in ("--fault", fault)]
    words += [word for key in (BOARD, *sets) for word in ("--set", key)]
    fast = ("run", "--fast", "--duration", str(seconds), "--viewer", "none", "--json", "f.json")
    ended = run(*fast, *options, *words)
    document: dict[str, Any] = json.loads((folder / "f.json").read_text())
    assert "Traceback" not in ended.err
    return ended, document


def causes(document: dict[str, Any]) -> set[str]:
    return {warning["cause"] for warning in document["link"]["warnings"]}


def test_a_healthy_line_is_warned_of_by_nothing(cli: Run, tmp_path: Path) -> None:
    done, document = fly(cli, tmp_path)
    assert (done.code, done.err) == (0, "")
    assert document["link"]["warnings"] == []
    assert document["link"]["missed"] == document["link"]["corrupt"] == document["link"]["lost"] == 0
    assert document["link"]["clock_error"] == pytest.approx(0.0, abs=1e-6)
    assert document["device_end"] == {"state": "IDLE", "fault": ""}


def test_lost_commands_are_told_by_the_script_and_kept_in_the_runs_folder(
    script: Run, tmp_path: Path
) -> None:
    done, document = fly(script, tmp_path, "wire.drop:p=0.6,way=up", options=("--note", "kept"))
    (run,) = (tmp_path / "runs").iterdir()
    assert done.code == 0
    assert causes(document) == {"commands_lost"}
    assert 0.5 < document["link"]["missed"] / document["link"]["samples"] < 0.7
    warning = document["troubles"][0].partition(": ")[2]
    assert done.err.splitlines()[0].endswith(warning)
    assert done.err.splitlines()[1].startswith("kept in runs/")
    assert json.loads((run / "summary.json").read_text())["link"] == document["link"]


@pytest.mark.parametrize(
    ("fault", "cause", "counter"),
    [
        ("wire.drop:p=0.6,way=up", "commands_lost", "missed"),
        ("wire.drop:p=0.02,way=up", "commands_lost", "missed"),
        ("wire.drop:p=0.2,way=down", "samples_lost", "lost"),
        ("wire.flip:p=0.01,way=up", "commands_damaged", "missed"),
        ("wire.flip:p=0.01,way=down", "samples_damaged", "corrupt"),
        ("wire.truncate:p=0.02,way=down", "samples_damaged", "corrupt"),
        ("wire.noise:rate=0.001,way=down", "samples_damaged", "corrupt"),
    ],
)
def test_losses_and_damage_have_their_cause(
    cli: Run, tmp_path: Path, fault: str, cause: str, counter: str
) -> None:
    done, document = fly(cli, tmp_path, fault)
    assert done.code == 0
    assert causes(document) == {cause}
    (warning,) = document["link"]["warnings"]
    assert done.err.count("\n") == 1  # one warning, once
    assert any(trouble.partition(": ")[2] in done.err for trouble in document["troubles"])
    assert document["link"][counter] >= 10
    assert str(document["link"][counter]) in done.out
    assert warning["share"] > 0.005


def test_one_percent_of_damaged_frames_both_ways_is_told_for_each_way(cli: Run, tmp_path: Path) -> None:
    done, document = fly(cli, tmp_path, "wire.flip:p=0.01")
    assert done.code == 0
    assert causes(document) == {"commands_damaged", "samples_damaged"}
    assert document["link"]["device"]["crc_errors"] > 15


def test_one_percent_of_bits_flipped_ends_the_run_and_names_damage(cli: Run, tmp_path: Path) -> None:
    done, document = fly(cli, tmp_path, "wire.noise:rate=0.01,at=1s")
    assert done.code in {3, 4}
    assert "damaged" in done.err
    assert "cable" in done.err
    assert causes(document) <= {"commands_damaged", "samples_damaged"}
    assert document["link"]["corrupt"] > 0


def test_a_line_with_nothing_but_damage_is_not_called_silent(cli: Run) -> None:
    at = ("--fault", "wire.noise:rate=0.2,at=boot", "--set", BOARD)
    done = cli("run", "--fast", "--duration", "1", "--viewer", "none", "--no-record", *at)
    assert done.code == 3
    assert "no valid frame" in done.err
    assert done.err.count("\n") == 1


@pytest.mark.parametrize(("percent", "words"), [("2", "2 % fast"), ("-2", "2 % slow"), ("10", "10 % fast")])
def test_device_clock_that_is_off(cli: Run, tmp_path: Path, percent: str, words: str) -> None:
    done, document = fly(cli, tmp_path, f"firmware.clock:percent={percent}")
    assert done.code == 0
    assert causes(document) == {"device_clock"}
    assert document["link"]["clock_error"] == pytest.approx(1e-2 * float(percent), rel=0.02)
    assert words in done.err
    assert "prescaler" in done.err
    assert "crystal" in done.err
    assert f"{float(percent):+.2f}" in done.out


def test_device_clock_that_goes_wrong_for_a_while_is_told(cli: Run, tmp_path: Path) -> None:
    done, document = fly(cli, tmp_path, "firmware.clock:percent=-2,at=1s,for=2.5s", seconds=8)
    (warning,) = document["link"]["warnings"]
    assert (done.code, warning["cause"]) == (0, "device_clock")
    assert warning["share"] == pytest.approx(-0.02, rel=0.02)
    assert document["link"]["clock_error"] == pytest.approx(0.0, abs=1e-3)
    (row,) = [line.split() for line in done.out.splitlines() if line.startswith("device's clock")]
    assert row[-3:] == ["-2.00", "%", "fast"]


def test_device_clock_within_its_crystal_is_no_news(cli: Run, tmp_path: Path) -> None:
    done, document = fly(cli, tmp_path, "firmware.clock:percent=0.3")
    assert (done.code, done.err) == (0, "")
    assert causes(document) == set()


def test_the_rates_are_keys_of_the_rig(cli: Run, tmp_path: Path) -> None:
    keys = ("backend.warn_clock_percent=0.1", "backend.warn_percent=2")
    done, document = fly(cli, tmp_path, "firmware.clock:percent=0.3", "wire.flip:p=0.01", sets=keys)
    assert done.code == 0
    assert causes(document) == {"device_clock"}


def test_disarm_that_never_arrives_is_said(cli: Run, tmp_path: Path) -> None:
    done, document = fly(cli, tmp_path, "wire.drop:p=1,way=up,at=2s")
    assert done.code == 0
    assert document["ended_by"] == "duration"
    assert document["device_end"] == {"state": "FAULT", "fault": "HOST_SILENT"}
    assert "HOST_SILENT" in done.out
    assert "did not reach it" in done.err
    assert done.err.count("\n") == 1
