"""Lines of `dcmp-hil sweep`: what it would take, quantiles, and the worst runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from dcmp_hil.sweeping.preparation import PreparedSweep
    from dcmp_hil.sweeping.result import SweepResult, WorstRun

_ENGINES = {"lanes": "the lanes in C", "plain": "the plain loop"}


def engine_sentences(prepared: PreparedSweep, where: str) -> list[str]:
    """Return which engine runs how many, where, and why it is not a faster one."""
    found = []
    for one in prepared.shares:
        share = "" if one.share >= 1.0 - prepared.refused else f" for {one.share:.0%} of the runs"
        why = f": {' '.join(one.reasons)}" if one.reasons else ""
        cost = f"{1e3 * one.cpu_s:.3g} ms of CPU time a run"
        found.append(f"engine: {_ENGINES[one.engine]}{share}, {cost}, in {where}{why}")
    if prepared.refused:
        found.append(f"refused: about {prepared.refused:.0%} of the runs, by the rules of the rig")
    return found


def dry_run_table(figures: Mapping[str, Any], sentences: Sequence[str]) -> Table:
    """Return a table of what a sweep would take."""
    table = Table(box=None, show_header=False, padding=(0, 1, 0, 0))
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    table.add_row("runs", f"{figures['runs']:,}")
    for sentence in sentences:
        name, _, rest = sentence.partition(": ")
        table.add_row(name, Text(rest))
    table.add_row("CPU time", f"{figures['cpu_s']:.3g} s")
    table.add_row("results", f"{1e-6 * figures['bytes']:.3g} MB at most, {figures['parts']:,} parts")
    table.add_row("folder", Text(str(figures["folder"])))
    return table


def quantile_table(result: SweepResult) -> Table:
    """Return a table with a row for each figure."""
    ended, refused = int(result.tripped.sum()), int(result.refused.sum())
    table = Table(
        title=Text(
            f"{result.table.num_rows:,} runs of {result.spec.duration_s:g} s: {ended:,} ended by the "
            f"supervisor, {refused:,} refused"
        ),
        title_justify="left",
        title_style="",
        header_style="dim",
        box=None,
        padding=(0, 1, 0, 0),
    )
    table.add_column("")
    for name in ("min", "5 %", "median", "95 %", "max"):
        table.add_column(name, justify="right", style="bold", no_wrap=True)
    for one in result.quantiles():
        table.add_row(one.figure, *(f"{value:.4g}" for value in one[1:]))
    return table


def worst_runs(worst: Sequence[WorstRun]) -> Iterator[Text]:
    """Yield lines about the worst runs, each with the command that repeats it."""
    if worst:
        yield Text("the worst runs, and what repeats each to the bit", style="dim")
    for one in worst:
        told = (
            f"ended at {one.trip_time_s:.3f} s ({one.trip_cause})"
            if one.tripped
            else f"{1e3 * one.tracking_rms_rad:.4g} mrad"
        )
        yield Text.assemble((f"run {one.run}", "bold"), f": {told}")
        yield Text(f"  {one.command}")
