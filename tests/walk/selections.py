"""Selections of combinations: every pair of values, or every value with every output."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

V = TypeVar("V")
_Pair = tuple[int, int, int, int]  # factor, place of its value, another factor, place of its value


def pairwise(factors: Mapping[str, Sequence[V]]) -> list[dict[str, V]]:
    """Return rows in which every two values of two factors meet, the same ones each time.

    Greedy: a row begins with a pair that has not met, and takes of every other factor the value that makes
    the most pairs meet; where several do, the one used least by then.
    """
    sizes = [len(values) for values in factors.values()]
    missing = set(itertools.chain.from_iterable(_pairs(a, b, sizes) for a, b in _couples(len(sizes))))
    used = [[0] * size for size in sizes]
    rows = []
    if len(sizes) == 1:
        return [{name: value} for name, values in factors.items() for value in values]
    while missing:
        row = _row(min(missing), missing, used)
        missing -= {(a, row[a], b, row[b]) for a, b in _couples(len(sizes))}
        for factor, place in row.items():
            used[factor][place] += 1
        rows.append({name: values[row[k]] for k, (name, values) in enumerate(factors.items())})
    return rows


def with_members(
    factors: Mapping[str, Sequence[V]], name: str, classes: Sequence[Sequence[V]]
) -> list[dict[str, V]]:
    """Return rows in which every two values meet, of one factor every class; its members take turns.

    There are as many rows as it takes for each member to come once.
    """
    rows = pairwise({**factors, name: [members[0] for members in classes]})
    for members in classes:
        alike = [row for row in rows if row[name] == members[0]]
        rows += [dict(row) for row, _ in zip(itertools.cycle(alike), members[len(alike) :], strict=False)]
    turns = {members[0]: itertools.cycle(members) for members in classes}
    return [{**row, name: next(turns[row[name]])} for row in rows]


def each_once(factors: Mapping[str, Sequence[V]]) -> list[dict[str, V]]:
    """Return rows in which every value comes once, for commands that take long; outputs take turns."""
    longest = max(len(values) for name, values in factors.items() if name != "output")
    return [{name: values[k % len(values)] for name, values in factors.items()} for k in range(longest)]


def combinations(factors: Mapping[str, Sequence[V]], most: int) -> list[dict[str, V]]:
    """Return all combinations; where there are more than `most`, of the factors with the most values.

    The other factors take turns.
    """
    by_size = sorted(factors, key=lambda name: -len(factors[name]))
    whole: list[str] = []
    size = 1
    for name in by_size:
        if size * len(factors[name]) <= most:
            whole.append(name)
            size *= len(factors[name])
    rows = []
    for k, chosen in enumerate(itertools.product(*(factors[name] for name in whole))):
        turn = {name: values[(k * 7 + k // 5) % len(values)] for name, values in factors.items()}
        rows.append(turn | dict(zip(whole, chosen, strict=True)))
    return rows


def _couples(count: int) -> list[tuple[int, int]]:
    return list(itertools.combinations(range(count), 2))


def _pairs(a: int, b: int, sizes: Sequence[int]) -> set[_Pair]:
    return {(a, i, b, j) for i in range(sizes[a]) for j in range(sizes[b])}


def _row(first: _Pair, missing: set[_Pair], used: list[list[int]]) -> dict[int, int]:
    row = {first[0]: first[1], first[2]: first[3]}
    for factor, counts in enumerate(used):
        if factor not in row:
            row[factor] = max(
                range(len(counts)),
                key=lambda place, factor=factor, counts=counts: (  # type: ignore[misc]
                    sum(_ordered(factor, place, *other) in missing for other in row.items()),
                    -counts[place],
                ),
            )
    return row


def _ordered(a: int, i: int, b: int, j: int) -> _Pair:
    return (a, i, b, j) if a < b else (b, j, a, i)
