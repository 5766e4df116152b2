"""The table of faults: what it counts, and when it fails."""

from __future__ import annotations

import json

import pytest

from tests.faults.matrix import Verdict
from tests.faults.rows import ROWS
from tools.faults import Line, merged, part_of, run_healthy, run_row, tell, variants

GOOD = Verdict("stuck", True, 80.0, ())
WRONG = Verdict("power", False, 120.0, ())
BAD = Verdict("stuck", True, 100.0, ("tick 7: 5 mV too much",))


def line(*verdicts: Verdict, fault: str = "plant.enc_stuck", open_: str = "") -> Line:
    made = Line(fault, 600.0, open=open_)
    for seed, verdict in enumerate(verdicts):
        made.add(seed, verdict)
    return made


def told(*lines: Line) -> tuple[int, str]:
    said: list[str] = []
    return tell(lines, 1.0, said.append), "".join(said)


def test_a_line_has_runs_violations_diagnoses_and_times() -> None:
    assert str(line(GOOD, WRONG, BAD, GOOD)) == (
        "| `plant.enc_stuck` | 4 | 1 | 75 | 90 | 120 | 600 | stuck 3, power 1 |"
    )


def test_figures_of_a_line_are_plain() -> None:
    figures = json.loads(json.dumps(line(GOOD, WRONG, BAD).figures()))
    assert figures["outcomes"] == {"stuck": 2, "power": 1}
    assert figures["right_percent"] == pytest.approx(200.0 / 3.0)


@pytest.mark.parametrize(
    ("verdicts", "code"),
    [((GOOD,) * 20, 0), ((*(GOOD,) * 19, WRONG), 0), ((*(GOOD,) * 18, WRONG, WRONG), 1), ((GOOD, BAD), 1)],
)
def test_it_fails_at_a_violation_or_below_95_percent(verdicts: tuple[Verdict, ...], code: int) -> None:
    assert told(line(*verdicts))[0] == code


def test_it_fails_at_a_single_false_trip() -> None:
    assert told(line(*(GOOD,) * 99, WRONG, fault="none"))[0] == 1


def test_an_open_row_is_shown_and_fails_nothing() -> None:
    code, said = told(line(GOOD), line(BAD, WRONG, open_="not done"))
    assert code == 0
    assert "(open: not done)" in said
    assert "seed 0: tick 7: 5 mV too much" in said


@pytest.mark.untraced
def test_rows_and_healthy_blocks_are_run() -> None:
    place = next(place for place, row in enumerate(ROWS) if row.fault == "firmware.stop")
    assert run_row(place, [1]).outcomes == {"STOPPED": 1}
    healthy = merged([run_healthy(range(1)), run_healthy(range(1, 2))])
    assert (healthy.runs, healthy.right) == (2, 2)


def test_ci_has_a_hundred_seeds_for_forty_rows_and_more() -> None:
    found = variants(range(len(ROWS)))
    assert sum(variant < 2 for variant in found) >= 60
    assert max(found) > 2
    assert found[0] == 0
    assert variants([3, 3, 3]) == [0, 1, 2]


def test_parts_are_all_seeds_once() -> None:
    parts = [part_of(range(3, 45), f"{number}/4") for number in range(1, 5)]
    assert [seed for part in parts for seed in part] == list(range(3, 45))
    assert {len(part) for part in parts} == {10, 11}
    for wrong in ("0/4", "5/4", "4", ""):
        with pytest.raises(ValueError):  # noqa: PT011 - argparse says which option
            part_of(range(4), wrong)
