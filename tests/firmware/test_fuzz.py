"""The fuzz target: the core agrees with its model, and errors that were put into it are found."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tools.fuzz import campaign
from tools.fuzz.__main__ import LEAST_TICKS, complaints, figures
from tools.fuzz.branches import UNREACHED, Reach
from tools.fuzz.build import CORE, Edit, Workshop, core_files
from tools.fuzz.campaign import Campaign, Counts, Outcome
from tools.fuzz.seeded import ERRORS

EXECUTION_COUNT = 50_000


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    try:
        return Workshop(tmp_path_factory.mktemp("fuzz"))
    except RuntimeError as missing:
        if os.environ.get("CI") == "true":
            pytest.fail(str(missing))
        pytest.skip(str(missing))


def test_every_seeded_error_is_found_and_the_core_has_none(workshop: Workshop, tmp_path: Path) -> None:
    clean = campaign.run(workshop.program("clean"), tmp_path, runs=EXECUTION_COUNT)
    assert complaints(clean, EXECUTION_COUNT, None) == [], clean.outcomes[0].wrong
    assert len(ERRORS) >= 7
    lived = []
    for name, seeded in ERRORS.items():
        program = workshop.program(name, seeded.edit)
        found = campaign.run(program, tmp_path, runs=seeded.within).outcomes[0]
        print(f"{name}: {found.executions} executions, {found.wrong}")  # noqa: T201
        if not found.wrong or found.input is None:
            lived.append(f"{name}: {seeded.says}, and {seeded.within} executions do not find it")
        program.unlink()
    assert not lived


def test_seeded_errors_are_in_different_places_of_the_core() -> None:
    assert len({(seeded.edit.file, seeded.edit.right) for seeded in ERRORS.values()}) == len(ERRORS)
    for seeded in ERRORS.values():
        assert seeded.edit.made() != (CORE / seeded.edit.file).read_text("utf-8")


def test_an_error_whose_place_is_gone_is_told() -> None:
    with pytest.raises(RuntimeError, match="has 0 times"):
        Edit("dcmp_guard.c", "no such text", "").made()


FEW = Counts(executions=100, ticks=1000, ticks_with_frames=790, in_run=20)
ENOUGH = FEW._replace(ticks_with_frames=LEAST_TICKS * 100)


def of(counts: Counts, wrong: str = "", reached: Reach | None = None) -> list[str]:
    """Return what is wrong with a campaign of one process that was to do 100 executions."""
    kept = None
    return complaints(Campaign((Outcome(counts, wrong, kept, 100),), 1.0, 1.0), 100, reached)


def test_what_a_campaign_complains_of() -> None:
    assert of(ENOUGH) == []
    assert of(ENOUGH, "a frame is the model's")[0].startswith("found: a frame")
    assert of(FEW) == ["fewer than 8 ticks with frames in an execution"]
    assert of(ENOUGH._replace(executions=99)) == ["only 99 executions of 100 in 1 s"]
    reached = Reach(1, 2, 1, 2, ("dcmp_x.c:3: if (x) {",))
    assert of(ENOUGH, reached=reached) == ["no input reaches all of dcmp_x.c:3: if (x) {"]
    assert "800" not in figures(Campaign((Outcome(ENOUGH, "", None, 100),), 2.0, 4.0))


def test_lines_that_no_input_reaches_are_lines_of_the_core() -> None:
    there = {
        f"{path.name}: {line.strip()}" for path in core_files() for line in path.read_text().splitlines()
    }
    assert set(UNREACHED) <= there
