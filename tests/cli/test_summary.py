"""The tables that end a run: what real time did not get is said there."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Console

from dcmp_hil import run
from dcmp_hil.cli.status_line import StatusLine
from dcmp_hil.cli.summary import summary_table
from dcmp_hil.platform.realtime import Grant
from dcmp_hil.telemetry.statistics import DurationHistogram
from tests.helpers import bench
from tests.telemetry.runs import T, blocks


def test_summary_says_what_was_not_granted_and_nothing_of_what_was() -> None:
    console = Console(width=200, force_terminal=False)
    result = run(bench(), duration=0.1, fast=True)
    grants = (Grant("locked memory"), Grant("SCHED_FIFO", "Operation not permitted. Do this"))
    with console.capture() as shown:
        console.print(summary_table(result.rig, replace(result, grants=grants), "duration"))
    assert "SCHED_FIFO was not granted: Operation not permitted. Do this." in shown.get()
    assert "locked memory" not in shown.get()


def test_summary_draws_the_durations_between_the_first_bound_and_the_last() -> None:
    console = Console(width=200, force_terminal=False)
    result = run(bench(), duration=0.1, fast=True)
    lateness = DurationHistogram((20.0, 50.0, 100.0), (1000, 0, 1))
    with console.capture() as shown:
        figures = replace(result.summary, lateness_histogram=lateness)
        console.print(summary_table(result.rig, replace(result, summary=figures), "duration"))
    (line,) = [line for line in shown.get().splitlines() if line.startswith("lateness")]
    assert line.rstrip().endswith("≤20 █ ▁ ≤100")


def test_status_line_shows_how_late_the_run_has_been_so_far() -> None:
    console = Console(width=250, force_terminal=True)
    with console.capture() as shown:
        line = StatusLine(console, T)
        for block in blocks(300):  # every 97th period is 700 us late
            line.block(block)
        line.close()
    assert "late 3  lateness 20 µs p99, 700 max" in shown.get()
