"""Run the core's fuzz target; fail if it finds something, or does or reaches less than it has to."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from tools.fuzz import campaign
from tools.fuzz.branches import reach
from tools.fuzz.build import ROOT, Workshop

if TYPE_CHECKING:
    from tools.fuzz.branches import Reach
    from tools.fuzz.campaign import Campaign

LEAST_TICKS = 8  # with frames, on average in an execution
_KEPT = ROOT / "reports" / "fuzz"


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=__doc__)
    parser.add_argument("--executions", type=int, default=10_000_000)
    parser.add_argument(
        "--jobs", type=int, default=min(2, os.cpu_count() or 1), help="processes (default: 2)"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=int, default=900, help="the longest it may take (default: 900)")
    parser.add_argument(
        "--no-branches", action="store_true", help="do not ask whether every branch was reached"
    )
    return parser.parse_args()


def figures(found: Campaign) -> str:
    """Return the counts of a campaign as text."""
    total = found.total
    each = max(1, total.executions)
    return (
        f"executions                 {total.executions:>14,}\n"
        f"executions a second        {total.executions / found.wall_s:>14,.0f}\n"
        f"executions a CPU second    {total.executions / found.cpu_s:>14,.0f}\n"
        f"ticks an execution         {total.ticks / each:>14.1f}\n"
        f"ticks with frames          {total.ticks_with_frames / each:>14.1f}  an execution\n"
        f"executions in RUN          {100 * total.in_run / each:>14.0f}  %\n"
        f"seconds                    {found.wall_s:>14.0f}\n"
    )


def complaints(found: Campaign, executions: int, reached: Reach | None) -> list[str]:
    """Return the requirements that a campaign violates."""
    wrong = [
        f"found: {each.wrong}\n  the input: {_kept(each.input)}" for each in found.outcomes if each.wrong
    ]
    total = found.total
    if not wrong and total.executions < executions:
        wrong.append(f"only {total.executions:,} executions of {executions:,} in {found.wall_s:.0f} s")
    if not wrong and total.ticks_with_frames < LEAST_TICKS * total.executions:
        wrong.append(f"fewer than {LEAST_TICKS} ticks with frames in an execution")
    if reached is not None:
        wrong += [f"no input reaches all of {line}" for line in reached.missing]
    return wrong


def _kept(path: Path | None) -> str:
    """Copy an input to where it outlives the campaign."""
    if path is None:
        return "none was kept"
    _KEPT.mkdir(parents=True, exist_ok=True)
    return str(shutil.copy(path, _KEPT))


def main() -> int:
    """Build, run, print."""
    asked = _asked()
    with tempfile.TemporaryDirectory() as kept:
        folder = Path(kept)
        try:
            program = Workshop(folder).program("fuzz")
            found = campaign.run(
                program,
                folder,
                runs=asked.executions,
                jobs=asked.jobs,
                seed=asked.seed,
                seconds=asked.seconds,
            )
            sys.stdout.write(figures(found))
            reached = None
            if not asked.no_branches and not any(each.wrong for each in found.outcomes):
                counting = folder / "counting"
                counting.mkdir()
                reached = reach(counting, campaign.corpora(folder))
                sys.stdout.write(
                    f"branches of the core       {reached.branches:>14}  of {reached.all_branches}\n"
                )
                sys.stdout.write(f"lines of the core          {reached.lines:>14}  of {reached.all_lines}\n")
        except RuntimeError as error:
            sys.stderr.write(f"error: {error}\n")
            return 3
        wrong = complaints(found, asked.executions, reached)
    sys.stderr.write("".join(f"{line}\n" for line in wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
