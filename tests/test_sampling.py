"""Samples are drawn from all, and their union over texts is everything."""

import pytest

from tests.sampling import chosen

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
