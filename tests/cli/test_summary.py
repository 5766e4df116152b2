"""The tables that end a run: what real time did not get is said there."""

from __future__ import annotations

from dataclasses import replace

from rich.console import Console

from dcmp_hil import run
from dcmp_hil.cli.summary import summary_table
from dcmp_hil.realtime import Grant
from tests.helpers import bench


def test_summary_says_what_was_not_granted_and_nothing_of_what_was() -> None:
    console = Console(width=200, force_terminal=False)
    result = run(bench(), duration=0.1, fast=True)
    grants = (Grant("locked memory"), Grant("SCHED_FIFO", "Operation not permitted. Do this"))
    with console.capture() as shown:
        console.print(summary_table(result.rig, replace(result, grants=grants), "duration"))
    assert "SCHED_FIFO was not granted: Operation not permitted. Do this." in shown.get()
    assert "locked memory" not in shown.get()
