"""`dcmp-hil monitor`: decoded traffic, live."""

from __future__ import annotations

from typing import Annotated

import typer

from dcmp_hil.cli.options import Overrides, RigName


def monitor(
    rig: RigName = "bench-serial",
    overrides: Overrides = None,
    duration: Annotated[float, typer.Option(metavar="S", help="Length, s; 0 = until Ctrl-C.")] = 0.0,
    all_frames: Annotated[
        bool, typer.Option("--all", help="Every SAMPLE and DRIVE, not ten a second.")
    ] = False,
) -> None:
    """Print what travels on a link, decoded, without taking part: no session, nothing is sent.

    A serial port has one reader: while a run has it, this says so and ends. An slcan adapter that is closed
    stays silent, for only a command opens it: let slcand do so, and watch its socketcan interface.
    """
    from dcmp_hil.cli.execute_monitor import watch
    from dcmp_hil.config import load_rig

    raise typer.Exit(watch(load_rig(rig, overrides or ()), duration, all_frames=all_frames))
