"""The tables that end a run: what real time did not get is said there."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from rich.console import Console

from dcmp_hil import run
from dcmp_hil.cli.status_line import StatusLine
from dcmp_hil.cli.summary import summary_table
from dcmp_hil.platform.realtime import Grant
from dcmp_hil.telemetry.statistics import BOUNDS_US, DurationHistogram, Percentiles
from tests.helpers import bench
from tests.telemetry.runs import T, blocks

if TYPE_CHECKING:
    from dcmp_hil.result import Result


COLUMNS = 80


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
        late = Percentiles(10.0, 15.0, 60.0, 70.0)
        figures = replace(result.summary, lateness_us=late, lateness_histogram=lateness)
        console.print(summary_table(result.rig, replace(result, summary=figures), "duration"))
    (line,) = [line for line in shown.get().splitlines() if line.startswith("lateness")]
    assert line.rstrip().endswith("≤20 µs █ ▁ ≤100 µs")


def test_summary_leaves_out_what_is_not_known_or_does_not_vary() -> None:
    """On a device nothing knows the truth; in virtual time every period is the nominal one."""
    result = run(bench(), duration=2.0, fast=True)
    device = replace(
        result.summary,
        velocity_error_rms_rad_s=None,
        velocity_error_max_rad_s=None,
        disturbance_error_rms_rad_s2=None,
        realtime_factor=math.nan,
    )
    shown = _shown(replace(result, summary=device))
    assert "unknown" not in shown
    assert "nan" not in shown
    assert [line[:19].strip() for line in shown.splitlines()[2:]] == [
        "tracking error, RMS",
        "tracking error, max",
        "voltage, peak",
        "voltage, total vari",
        "periods",
    ]
    assert "mrad, by the encoder" in shown


def test_summary_has_durations_that_were_measured_and_explains_their_bars() -> None:
    result = run(bench(), duration=0.1, fast=True)
    values, bars = (
        Percentiles(10.0, 40.0, 60.0, 2.5e6),
        DurationHistogram((10.0, 20.0, 50.0, math.inf), (90, 0, 9, 1)),
    )
    measured = replace(
        result.summary,
        period_us=values,
        lateness_us=values,
        compute_us=values,
        period_histogram=bars,
        lateness_histogram=bars,
        compute_histogram=bars,
    )
    lines = _shown(replace(result, summary=measured)).splitlines()
    table = next(k for k, line in enumerate(lines) if line.startswith("µs"))
    assert lines[table].split() == ["µs", "p50", "p99", "p99.9", "max", "how", "often"]
    row = ["10.0", "40.0", "60.0", "2500000", "≤10", "µs", "█", "▅▂", ">1", "s"]
    for line, what in zip(lines[table + 1 :], ("period", "lateness", "sample to command"), strict=False):
        assert line.startswith(what)
        assert line.removeprefix(what).split() == row
    assert lines[table + 4].startswith("how often: a bar for each range of durations")
    assert all(len(line) <= COLUMNS for line in lines)


def test_no_duration_is_cut_off_at_80_columns() -> None:
    result = run(bench(), duration=0.1, fast=True)
    values, bars = (
        Percentiles(1000.0, 97464.0, 99433.0, 999999.0),
        DurationHistogram(BOUNDS_US, (1,) * len(BOUNDS_US)),
    )
    wide = replace(result.summary, compute_us=values, compute_histogram=bars)
    (line,) = [
        line for line in _shown(replace(result, summary=wide)).splitlines() if line.startswith("sample")
    ]
    assert line.startswith("sample to command  1000.0  97464  99433  999999  ≤1 µs ███████")


def _shown(result: Result) -> str:
    console = Console(width=COLUMNS, force_terminal=False)
    with console.capture() as shown:
        console.print(summary_table(result.rig, result, "duration"))
    return "\n".join(line.rstrip() for line in shown.get().splitlines())


def test_status_line_shows_how_late_the_run_has_been_so_far() -> None:
    console = Console(width=250, force_terminal=True)
    with console.capture() as shown:
        line = StatusLine(console, T)
        for block in blocks(300):  # every 97th period is 700 us late
            line.block(block)
        line.close()
    assert "late 3  lateness 20 µs p99, 700 max" in shown.get()
