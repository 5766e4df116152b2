"""The recordings of ../shared/cases: the command that a user would type, and the figure that is right."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.cli.conftest import Outcome
    from tests.installed import Finished

    Cli = Callable[..., Outcome]
    Script = Callable[..., Finished]

CASES = Path(__file__).resolve().parents[2].parent / "shared" / "cases"
CONTROL_RMS_RAD_S = 0.06186  # rad/s

needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="the recordings are not at ../shared/cases")


class Right(NamedTuple):
    """True values of a case."""

    options: str = "--ku 5.4"
    rms: float = CONTROL_RMS_RAD_S
    near: float = 1e-4
    rows: int = 4000
    note: str = ""
    file: str = "rec.csv"


GERMAN = "--ku 5.4 --time 'Zeit [s]' --position 'Winkel [°]' --position-unit deg --voltage 'Spannung [V]'"
RIGHT: dict[str, Right] = {
    "a-decimal-comma": Right(),
    "c-latin1": Right(GERMAN, note="Windows-1252"),
    "c-latin1 ": Right(),
    "d-units-row": Right(),
    "e-preamble": Right(note="4 lines before the header left out"),
    "f-coarse-clock-ms": Right(note="2400 of the stamps repeat"),
    "f-coarse-clock-ms ": Right(
        "--ku 5.4 --period 0.002", near=1e-5, note="Evenly sampled, 0.002 s (--period)"
    ),
    "f-coarse-clock-ms  ": Right("--ku 5.4 --period 0.002 --time none", near=1e-5, note="Evenly sampled"),
    "f2-arduino-two-decimals": Right(note="3199 of the stamps repeat"),
    "f2-arduino-two-decimals ": Right("--ku 5.4 --period 0.002", near=1e-5),
    "f3-one-row-twice": Right(note="1 row left out that the file holds twice"),
    "g-empty-cells": Right(rows=3996, near=1e-3, note="4 rows left out without a number in position_rad"),
    "h-micros-wrap": Right(note="The time counter wraps at 2^32 in 1 place"),
    "i-iso-time": Right(),
    "j-numpy-savetxt": Right(file="rec.txt"),
    "l-free-swing-no-input": Right("--no-input", rms=0.0259),
    "l-free-swing-no-input ": Right("--voltage none", rms=0.0259),
    "m-counts-wrap-16bit-2000": Right("--ku 5.4 --counts-per-rev 2000", rms=0.0687, note="65536"),
    "m-counts-wrap-16bit-2000 ": Right("--ku 5.4 --counts-per-rev 2000 --modulus 65536", rms=0.0687),
    "m-counts-wrap-16bit-4096": Right("--ku 5.4 --counts-per-rev 4096", rms=0.0466, note="65536"),
    "o-torn-last-line": Right(rows=3999, note="1 line left out"),
    "p-serial-capture": Right(note="3 lines before the header left out"),
    "s-excel-sep-line": Right(),
    "t-ntp-step-back-250ms": Right(
        rms=0.0615, near=2e-3, note="goes back in 1 place, the first time by 0.25 s"
    ),
    "u-sample-number-no-time": Right("--ku 5.4 --time sample --period 0.002"),
    "u-sample-number-no-time ": Right("--ku 5.4 --period 0.002"),
    "v-velocity-ambiguous": Right(note="No velocity of the file is taken"),
    "w7-header-and-footer": Right(note="1 line left out"),
}


def arguments(case: str) -> tuple[str, ...]:
    import shlex

    return "replay", str(CASES / case.strip() / RIGHT[case].file), *shlex.split(RIGHT[case].options)


def check(case: str, figures: dict[str, object], err: str) -> None:
    right = RIGHT[case]
    assert figures["velocity_error_rms_rad_s"] == pytest.approx(right.rms, abs=right.near)
    assert figures["rows"] == right.rows
    notes = figures["notes"]
    columns = figures["columns"]
    assert isinstance(notes, list)
    assert isinstance(columns, list)
    assert right.note in " ".join(notes)
    assert err.splitlines() == [*columns, *notes]


@needs_cases
def test_every_recording_is_a_row_of_the_table() -> None:
    recordings = {folder.name for folder in CASES.iterdir() if any(folder.glob("rec.*"))}
    assert recordings == {case.strip() for case in RIGHT}


@needs_cases
@pytest.mark.parametrize("case", RIGHT)
def test_recordings_give_their_figure(case: str, cli: Cli) -> None:
    outcome = cli(*arguments(case), "--no-write", "--json", "-")
    assert outcome.code == 0, outcome.err
    check(case, json.loads(outcome.out), outcome.err)


@needs_cases
@pytest.mark.parametrize(
    "case",
    ["f2-arduino-two-decimals", "m-counts-wrap-16bit-2000", "l-free-swing-no-input", "p-serial-capture"],
)
def test_the_installed_script_gives_the_figure_and_leaves_two_files(
    case: str, script: Script, tmp_path: Path
) -> None:
    done = script(*arguments(case), "--json", "-", cwd=tmp_path)
    assert done.code == 0
    wrote = ["wrote rec-replay.csv", "wrote rec-replay.rrd"]
    assert done.err.splitlines()[-2:] == wrote
    check(case, json.loads(done.out), "\n".join(done.err.splitlines()[:-2]))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["rec-replay.csv", "rec-replay.rrd"]


@needs_cases
@pytest.mark.parametrize(
    ("case", "options", "remedy"),
    [
        ("l-free-swing-no-input", (), "--no-input"),
        ("u-sample-number-no-time", ("--ku", "5.4"), "--period"),
        ("u-sample-number-no-time", ("--ku", "5.4", "--time", "sample"), "--period"),
        ("m-counts-wrap-16bit-2000", ("--ku", "5.4"), "--counts-per-rev"),
        ("f-coarse-clock-ms", ("--period", "0.005"), "--time none"),
    ],
)
def test_what_is_in_doubt_names_the_option(
    case: str, options: tuple[str, ...], remedy: str, cli: Cli, tmp_path: Path
) -> None:
    outcome = cli("replay", str(CASES / case / "rec.csv"), *options)
    assert (outcome.code, outcome.out) == (2, "")
    assert remedy in outcome.err
    assert list(tmp_path.iterdir()) == []
