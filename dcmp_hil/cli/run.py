"""`dcmp-hil run`: run a rig, show it, keep it."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from dcmp_hil.cli.options import Force, JsonFile, Overrides, RigName, duration_of
from dcmp_hil.common.printable_text import readable


class Viewer(StrEnum):
    """The choices of `--viewer`."""

    SPAWN = "spawn"
    WEB = "web"
    SERVE = "serve"
    CONNECT = "connect"
    NONE = "none"


def run(  # noqa: PLR0913, PLR0917 - a command has that many options
    rig: RigName = "bench-1khz",
    overrides: Overrides = None,
    duration: Annotated[
        float | None,
        typer.Option(
            "--duration",
            metavar="TIME",
            parser=duration_of("--duration"),
            help="Length, such as 10s or 2min; 0 = until Ctrl-C.",
        ),
    ] = None,
    window_from: Annotated[
        float,
        typer.Option(
            "--from", metavar="TIME", parser=duration_of("--from"), help="Start of the figures, such as 5s."
        ),
    ] = 0.0,
    fast: Annotated[
        bool, typer.Option("--fast", help="Virtual time: as fast as it computes (simulated rig).")
    ] = False,
    viewer: Annotated[
        Viewer | None,
        typer.Option(
            metavar="HOW",
            help="spawn: a window. web: a page in a browser. serve: for viewers that come and go (dcmp-hil "
            "view). connect: the viewer that runs already. none. By default a window if there is a display.",
        ),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE.rrd", help="Path of the recording, instead of the run's folder."),
    ] = None,
    no_record: Annotated[bool, typer.Option("--no-record", help="Write no folder under runs/.")] = False,
    json_file: JsonFile = None,
    note: Annotated[str, typer.Option(metavar="TEXT", help="Text that is kept with the run's figures.")] = "",
    faults: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="KIND:...",
            help="Inject a fault, such as wire.drop:p=0.2,at=3s,for=1s (simulated rig). Repeatable.",
        ),
    ] = None,
    clear: Annotated[
        bool,
        typer.Option(
            "--clear",
            help="Clear a fault of the device that waits for a person: STOP by a person, the amplifier's own "
            "protection, an internal fault of the board.",
        ),
    ] = False,
    no_control: Annotated[
        bool, typer.Option("--no-control", help="Do not listen for `dcmp-hil set`, `stop` and `panel`.")
    ] = False,
    compare: Annotated[
        list[str] | None,
        typer.Option(
            "--compare",
            metavar="OBSERVERS",
            help="Run these observers beside the loop, and compare them: kalman,derivative. Repeatable.",
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Run a rig: read the encoder, estimate, control, write the voltage, stream to Rerun.

    Ctrl-C ends the run at 0 V and keeps the recording.
    """
    from dcmp_hil.cli.execute_run import Options, execute

    options = Options(
        duration=duration,
        window_from=window_from,
        fast=fast,
        viewer=viewer.value if viewer else None,
        record=record,
        keep=not no_record,
        json_file=json_file,
        note=readable(note),
        faults=tuple(faults or ()),
        control=not no_control,
        clear=clear,
        compare=tuple(compare or ()),
        force=force,
    )
    raise typer.Exit(execute(rig, overrides or (), options))
