"""A question for the name that was meant, and the one for a name that resembles none."""

from __future__ import annotations

import pytest

from dcmp_hil.common.similar_names import closest, did_you_mean

NAMES = ("position", "velocity", "voltage")


@pytest.mark.parametrize(("got", "meant"), [("positon", "position"), ("velocty", "velocity"), ("xyz", None)])
def test_closest_is_the_most_similar_name_or_none(got: str, meant: str | None) -> None:
    assert closest(got, iter(NAMES)) == meant


def test_cutoff_says_how_similar_a_name_must_be() -> None:
    assert closest("volt", NAMES, cutoff=0.9) is None
    assert closest("volt", NAMES, cutoff=0.4) == "voltage"


def test_question_names_the_similar_name_as_it_is_written() -> None:
    assert did_you_mean("voltag", NAMES) == 'Did you mean "voltage"?'
    assert did_you_mean("voltag", NAMES, shown=str.upper) == "Did you mean VOLTAGE?"


def test_without_a_similar_name_there_is_no_question() -> None:
    assert did_you_mean("xyz", NAMES) == ""
    assert did_you_mean("xyz", NAMES, "Known: all.") == "Known: all."
