"""`dcmp-hil monitor`: decoded traffic, live."""

from __future__ import annotations

from typing import Annotated

import typer

from dcmp_hil.cli.options import Overrides, RigName, length_of


def monitor(
    rig: RigName = "bench-serial",
    overrides: Overrides = None,
    duration: Annotated[
        float,
        typer.Option(
            metavar="TIME",
            parser=length_of("--duration"),
            help="Length, such as 10s or 2min; 0 = until Ctrl-C.",
        ),
    ] = 0.0,
    all_frames: Annotated[
        bool, typer.Option("--all", help="Print every SAMPLE and DRIVE, not ten a second.")
    ] = False,
) -> None:
    """Print the decoded traffic of a link; there is no session, and nothing is sent.

    A serial port has one reader: while a run uses it, the command says so and ends. A closed slcan adapter
    stays silent, because only a command opens it: open it with slcand, and monitor its socketcan interface.
    """
    from dcmp_hil.cli.execute_monitor import watch
    from dcmp_hil.config import load_rig

    raise typer.Exit(watch(load_rig(rig, overrides or ()), duration, all_frames=all_frames))
