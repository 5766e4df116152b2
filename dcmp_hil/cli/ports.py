"""`dcmp-hil ports`: what is plugged in, and what answers."""

from __future__ import annotations

import shlex
from typing import Annotated

import typer

from dcmp_hil.cli import console
from dcmp_hil.cli.options import duration_of
from dcmp_hil.common.number_range import NumberRange
from dcmp_hil.errors import ConfigError

_WAIT_RANGE_S = NumberRange(0.1, 60.0)


def ports(
    port: Annotated[
        list[str] | None,
        typer.Argument(metavar="PORT", help="Additional serial ports, such as /dev/pts/3."),
    ] = None,
    baud: Annotated[
        int, typer.Option(metavar="BIT_S", min=9600, max=12_000_000, help="Of serial ports.")
    ] = 1_000_000,
    bitrate: Annotated[
        int, typer.Option(metavar="BIT_S", min=10_000, max=1_000_000, help="Of CAN buses.")
    ] = 1_000_000,
    wait: Annotated[
        float,
        typer.Option(
            metavar="TIME",
            parser=duration_of("--wait"),
            help="Wait for the first sample, 100ms to 60s: some boards boot first.",
        ),
    ] = 0.25,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose",
            "-v",
            help="Also print each device's number of boots, cause of reset, and last fault.",
        ),
    ] = False,
) -> None:
    """List serial ports and CAN channels, and the device on each.

    The command listens first, and asks only if it hears a device of this project. A closed slcan
    adapter stays silent, because only a command opens it: `run` and slcand do so. An open CAN adapter
    takes part in its bus: give the right --bitrate.
    """
    if not _WAIT_RANGE_S.holds(wait):
        raise ConfigError(f"--wait: got {wait:g} s; expected 100ms to 60s.")

    from rich.text import Text

    from dcmp_hil.device.discovery import find_devices
    from dcmp_hil.platform.clock import MonotonicClock

    found = 0
    for finding in find_devices(port or (), baud, bitrate, MonotonicClock(), wait, history=verbose):
        found += 1
        console.out.print(Text.assemble((finding.place, "bold"), f"  {finding.description}"))
        device = Text(f"    {finding.device}", "green" if finding.settings else "dim")
        console.print_sentence(console.out, device, indent=4)
        if finding.history:
            console.print_sentence(console.out, Text(f"    {finding.history}"), indent=4)
        if finding.settings:
            sets = [word for key in finding.settings for word in ("--set", f"backend.{key}")]
            console.out.print(Text(f"    {shlex.join(['dcmp-hil', 'run', *sets])}"))
    if not found:
        console.note(
            "No serial port and no CAN channel here. `dcmp-hil device` makes a virtual one; name its port "
            "to see it: dcmp-hil ports /dev/pts/N"
        )
