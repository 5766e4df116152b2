"""`make limits`: wrong observers against speed limits, and healthy arms under limits; the table."""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from tests.attacks.hostile.wrong_observers import KINDS
from tests.attacks.limit_runs import BY, LIMITS_RAD_S, NEEDED, attack, healthy, most_speed, rig_under

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tests.attacks.limit_runs import Healthy, Outcome

_SHOWN_MAX = 5


class Cell(NamedTuple):
    """Attacks that differ only in their seed."""

    by: str
    limit: float
    kind: str


def _attacked(job: tuple[Cell, int]) -> tuple[Cell, Outcome]:
    cell, seed = job
    return cell, attack(cell.limit, cell.kind, seed, cell.by)


def attacks(seeds: int, jobs: int) -> dict[Cell, list[Outcome]]:
    """Run every cell with so many seeds."""
    cells = [Cell(*one) for one in product(BY, LIMITS_RAD_S, KINDS)]
    found: dict[Cell, list[Outcome]] = defaultdict(list)
    with ProcessPoolExecutor(jobs) as pool:
        for cell, outcome in pool.map(_attacked, product(cells, range(seeds)), chunksize=20):
            found[cell].append(outcome)
    return found


def most(by: str, limit: float, seed: int) -> float:
    """Return the highest speed that docs/safety.md allows at 0 V to the arm of a seed, rad/s."""
    return min(most_speed(rig_under(limit, seed), by), NEEDED.get((by, limit), float("inf")))


def table(found: dict[Cell, list[Outcome]]) -> Iterable[str]:
    """Lay out the fastest true speed at 0 V by limit and observer, and the most that gravity added."""
    yield f"| kept by | limit | allowed (least noise) | {' | '.join(KINDS)} | half a second after 0 V |"
    yield f"|---|---|---|{'---|' * len(KINDS)}---|"
    for by, limit in product(BY, LIMITS_RAD_S):
        row = [found[Cell(by, limit, kind)] for kind in KINDS]
        speeds = " | ".join(f"{max(outcome.speed for outcome in cell):.2f}" for cell in row)
        later = max(outcome.afterwards for cell in row for outcome in cell)
        least = min(most(by, limit, seed) for seed in range(len(row[0])))
        yield f"| {by} | {limit:g} | {least:.2f} | {speeds} | {later:.2f} |"


def beyond(found: dict[Cell, list[Outcome]]) -> list[str]:
    """Return the attacks that exceeded a bound."""
    return [
        f"{cell.by} alone, {cell.limit:g} rad/s, {cell.kind}, seed {seed}: {outcome.speed:.3f} rad/s at 0 V"
        for cell, outcomes in found.items()
        for seed, outcome in enumerate(outcomes)
        if not outcome.speed <= most(cell.by, cell.limit, seed)
    ]


def stopped(verdicts: Sequence[Healthy]) -> list[str]:
    """Return the healthy arms that were stopped before they had passed a limit."""
    return [f"healthy, seed {seed}: {one.reason}" for seed, one in enumerate(verdicts) if one.is_false]


def main() -> None:
    """Run both, print the tables, and fail if an attack got through or a healthy arm was stopped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, help="of each limit, observer and side")
    parser.add_argument("--healthy", type=int, default=1000, help="runs")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--markdown", type=Path, help="where the table goes as well")
    asked = parser.parse_args()
    found = attacks(asked.seeds, asked.jobs)
    with ProcessPoolExecutor(asked.jobs) as pool:
        verdicts = list(pool.map(healthy, range(asked.healthy), chunksize=10))
    wrong = [*beyond(found), *stopped(verdicts)]
    passed = sum(one.reason != "completed" and not one.is_false for one in verdicts)
    counted = (
        f"{asked.healthy} healthy arms that start anywhere: {len(stopped(verdicts))} stopped below "
        f"their limit, {passed} as they passed it."
    )
    lines = [
        f"The fastest of {asked.seeds} seeds each, rad/s, at the instant from which on the voltage is 0.",
        "",
        *table(found),
        "",
        counted,
        *wrong[:_SHOWN_MAX],
    ]
    text = "\n".join(lines) + "\n"
    sys.stdout.write(text)
    if asked.markdown:
        asked.markdown.write_text(text, encoding="utf-8")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
