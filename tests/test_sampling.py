"""Samples are drawn from all, and their union over texts is everything."""

import sys
from collections.abc import Sequence
from pathlib import Path
from subprocess import run

import pytest

from tests.installed import environment
from tests.sampling import WHOLE, chosen, file_is_drawn

HERE = Path(__file__).parent
NAMES = [f"test[{case}]" for case in range(21)]


@pytest.mark.parametrize(("one_in", "count"), [(1, 21), (4, 6), (30, 1)])
def test_sample_has_the_share_asked_for(one_in: int, count: int) -> None:
    assert len(chosen(NAMES, one_in, "commit")) == count
    assert chosen(NAMES, one_in, "commit") <= set(NAMES)


def test_same_text_draws_the_same_and_all_texts_everything() -> None:
    assert chosen(NAMES, 4, "a") == chosen(list(reversed(NAMES)), 4, "a")
    drawn = [chosen(NAMES, 4, str(commit)) for commit in range(60)]
    assert len(set(map(frozenset, drawn))) > 50
    assert set().union(*drawn) == set(NAMES)


def _drawn(files: Sequence[Path], text: str) -> set[Path]:
    return {file for file in files if file_is_drawn(file, 4, text)}


def test_files_are_drawn_of_every_folder_and_all_texts_draw_every_file() -> None:
    files = [*HERE.rglob("test_*.py")]
    drawn = [_drawn(files, str(commit)) for commit in range(60)]
    assert all({file.parent for file in each} == {file.parent for file in files} for each in drawn)
    assert max(map(len, drawn)) < 0.35 * len(files)
    assert set().union(*drawn) == set(files)
    whole = {file for file in files if file.parent.name in WHOLE}
    assert {file.parent.name for file in whole} == set(WHOLE)
    assert all(whole <= each for each in drawn)


def test_files_that_are_not_drawn_are_not_collected() -> None:
    command = [sys.executable, "-m", "pytest", "--collect-only", "-qq", "-n0", "--no-cov", "tests/wire"]
    command += ["--sample-files", "4", "--sample-of", "a"]
    done = run(command, check=False, cwd=HERE.parent, env=environment(), capture_output=True, text=True)
    collected = {HERE.parent / line.partition(":")[0] for line in done.stdout.split("\n") if line}
    assert collected == _drawn([*(HERE / "wire").glob("test_*.py")], "a"), done.stderr
