"""`python -m tools.faults`: kinds of fault x seeds in virtual time, and the table of what came of them."""

from __future__ import annotations

import argparse
import json
import math
import statistics
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from dcmp_hil.platform.clock import MonotonicClock
from tests.faults.matrix import judge
from tests.faults.null_plan import healthy
from tests.faults.rows import ROWS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tests.faults.matrix import Verdict

_HEAD = (
    "| fault | runs | violations | diagnosed right, % | to 0 V, ms: median | max | bound | outcomes |",
    "|---|---:|---:|---:|---:|---:|---:|---|",
)
_RIGHT_MIN_PERCENT = 95.0  # %
_SHOWN_MAX, _REARM_PERIOD_SEEDS = 3, 25
_FIRST_VARIANT_COUNT = 2


@dataclass
class Line:
    """A row of the table."""

    fault: str
    bound_ms: float | None = None
    runs: int = 0
    right: int = 0
    reactions_ms: list[float] = field(default_factory=list)
    outcomes: Counter[str] = field(default_factory=Counter)
    violations: dict[int, tuple[str, ...]] = field(default_factory=dict)
    open: str = ""

    def add(self, seed: int, verdict: Verdict) -> None:
        """Count a run."""
        self.runs += 1
        self.right += verdict.right
        self.outcomes[verdict.outcome] += 1
        if verdict.violations:
            self.violations[seed] = verdict.violations
        if not math.isnan(verdict.reaction_ms):
            self.reactions_ms.append(verdict.reaction_ms)

    @property
    def right_percent(self) -> float:
        """Share of runs whose cause was named correctly, %."""
        return 100.0 * self.right / self.runs

    def figures(self) -> dict[str, object]:
        """Return everything, for JSON."""
        return {**vars(self), "outcomes": dict(self.outcomes), "right_percent": self.right_percent}

    def __str__(self) -> str:
        """Return the row in Markdown."""
        times = self.reactions_ms
        median, most = (f"{statistics.median(times):.0f}", f"{max(times):.0f}") if times else ("", "")
        bound = "" if self.bound_ms is None else f"{self.bound_ms:g}"
        outcomes = ", ".join(f"{name} {count}" for name, count in self.outcomes.most_common())
        note = f" (open: {self.open})" if self.open else ""
        cells = (f"`{self.fault}`{note}", self.runs, len(self.violations), f"{self.right_percent:.0f}")
        return f"| {' | '.join(map(str, (*cells, median, most, bound, outcomes)))} |"


def run_row(place: int, seeds: Sequence[int]) -> Line:
    """Run a row of the matrix; every 25th run goes on with a healthy one."""
    row = ROWS[place]
    line = Line(row.name, row.bound_ms, open=row.open)
    for seed in seeds:
        line.add(seed, judge(row, seed, rearm=seed % _REARM_PERIOD_SEEDS == 0))
    return line


def run_healthy(seeds: Sequence[int]) -> Line:
    """Run healthy seeds; return the row of the table."""
    line = Line("none")
    for seed in seeds:
        line.add(seed, healthy(seed))
    return line


def merged(lines: Sequence[Line]) -> Line:
    """Return blocks of healthy runs as one row."""
    whole = Line("none")
    for line in lines:
        whole.runs += line.runs
        whole.right += line.right
        whole.outcomes += line.outcomes
        whole.violations |= line.violations
    return whole


def tell(lines: Sequence[Line], seconds: float, write: Callable[[str], object]) -> int:
    """Write table and findings; return 1 if a row that is not open has any."""
    write("\n".join((*_HEAD, *map(str, lines))) + "\n\n")
    judged = [line for line in lines if not line.open]
    for line in lines:
        for seed, found in sorted(line.violations.items())[:_SHOWN_MAX]:
            write(f"{line.fault}, seed {seed}: {'; '.join(found[:_SHOWN_MAX])}\n")
    runs, right = sum(line.runs for line in judged), sum(line.right for line in judged)
    broken = sum(len(line.violations) for line in judged)
    write(
        f"\n{len(judged)} rows and {len(lines) - len(judged)} open ones, {sum(line.runs for line in lines)} "
        f"runs in {seconds:.0f} s: {broken} violations, {100.0 * right / runs:.2f} % diagnosed right; open "
        "rows are in neither figure.\n"
    )
    false_trips = any(line.right < line.runs for line in judged if line.fault == "none")
    return int(broken > 0 or false_trips or not 100.0 * right / runs >= _RIGHT_MIN_PERCENT)


def variants(places: Sequence[int]) -> list[int]:
    """Return for each row how many rows of its kind come before it."""
    seen: Counter[str] = Counter()
    found = []
    for place in places:
        kind = ROWS[place].fault.partition(":")[0].partition(" ")[0]
        found.append(seen[kind])
        seen[kind] += 1
    return found


def part_of(seeds: range, part: str) -> range:
    """Return one of equal parts of some seeds.

    Parameters
    ----------
    seeds
        All of them.
    part
        Such as ``2/4``: the second quarter.

    Raises
    ------
    ValueError
        If there is no such part.
    """
    number, _, of = part.partition("/")
    place, parts = int(number) - 1, int(of)
    if not 0 <= place < parts:
        raise ValueError(part)
    return seeds[len(seeds) * place // parts : len(seeds) * (place + 1) // parts]


def main() -> int:
    """Run, tell, and leave with 1 if something is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tools.faults", description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="runs of each row (default: 5)")
    parser.add_argument(
        "--further", type=int, help="runs of each third and later variant of a kind (as many)"
    )
    parser.add_argument("--first", type=int, default=0, help="the first seed (default: 0)")
    parser.add_argument("--healthy", type=int, default=50, help="runs without a fault (default: 50)")
    parser.add_argument("--part", default="1/1", metavar="K/N", help="only this part of all seeds")
    parser.add_argument("--only", default="", metavar="TEXT", help="rows whose text has this in it")
    parser.add_argument("--processes", type=int, default=2, help="(default: 2)")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="where the table goes as well")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go as well")
    asked = parser.parse_args()
    clock = MonotonicClock()
    began_ns = clock.now_ns()
    places = [place for place, row in enumerate(ROWS) if asked.only in row.fault]
    wells = part_of(range(asked.healthy), asked.part)
    blocks = min(len(wells), 20)
    with ProcessPoolExecutor(asked.processes) as pool:
        further = asked.seeds if asked.further is None else min(asked.further, asked.seeds)
        runs = [asked.seeds if variant < _FIRST_VARIANT_COUNT else further for variant in variants(places)]
        seeds = [part_of(range(asked.first, asked.first + n), asked.part) for n in runs]
        lines = pool.map(run_row, places, seeds)
        healthy_seeds = [wells[block::blocks] for block in range(blocks)]
        table = [*lines, *([merged([*pool.map(run_healthy, healthy_seeds)])] if blocks else [])]
    said: list[str] = []
    code = tell(table, 1e-9 * (clock.now_ns() - began_ns), said.append)
    sys.stdout.write("".join(said))
    if asked.markdown:
        asked.markdown.write_text("".join(said), encoding="utf-8")
    if asked.json:
        figures = [line.figures() for line in table]
        asked.json.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    return code


if __name__ == "__main__":
    sys.exit(main())
