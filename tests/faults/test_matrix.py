"""Kinds x seeds in virtual time: every fault ends as it should, and the oracle has nothing to say.

DCMP_FAULT_SEEDS sets how many seeds; `python -m tools.faults` runs a hundred and prints the table.
"""

from __future__ import annotations

import os

import pytest

from tests.faults.matrix import Verdict, judge, judge_plain
from tests.faults.null_plan import healthy
from tests.faults.rows import PLAIN, ROWS, Row

SEEDS = int(os.environ.get("DCMP_FAULT_SEEDS", "2"))
pytestmark = pytest.mark.untraced


def cells(rows: tuple[Row, ...]) -> list[object]:
    """Return the rows as parameters; an open one may fail."""
    return [
        pytest.param(
            row,
            id=row.name,
            marks=pytest.mark.xfail(reason=row.open, strict=False) if row.open else (),
        )
        for row in rows
    ]


def assert_told_right(verdicts: list[Verdict]) -> None:
    """Let a diagnosis be wrong now and then, where there are many; among fewer than ten none may be."""
    wrong = [verdict.outcome for verdict in verdicts if not verdict.right]
    assert len(wrong) <= len(verdicts) // 10, wrong


@pytest.mark.parametrize("row", cells(ROWS))
def test_fault_ends_as_it_should_and_leaves_the_oracle_silent(row: Row) -> None:
    verdicts = [judge(row, seed, rearm=seed == 0) for seed in range(SEEDS)]
    assert [verdict.violations for verdict in verdicts] == [()] * SEEDS
    assert_told_right(verdicts)


@pytest.mark.parametrize("row", cells(PLAIN))
def test_fault_ends_as_it_should_on_the_plain_simulated_rig(row: Row) -> None:
    verdicts = [judge_plain(row, seed) for seed in range(SEEDS)]
    assert [verdict.violations for verdict in verdicts] == [()] * SEEDS
    assert_told_right(verdicts)


@pytest.mark.parametrize("first", range(0, 10 * SEEDS, 5))
def test_healthy_rigs_never_trip(first: int) -> None:
    verdicts = {seed: healthy(seed) for seed in range(first, first + 5)}
    assert {
        seed: verdict for seed, verdict in verdicts.items() if verdict.violations or not verdict.right
    } == {}


def test_there_are_kinds_enough() -> None:
    assert len({row.fault for row in ROWS if not row.open}) >= 40


def test_matrix_notices_a_wrong_diagnosis() -> None:
    row = next(row for row in ROWS if row.fault == "plant.power")
    assert not judge(row._replace(right=frozenset({"stuck"})), 0).right
