"""`dcmp-hil device`: a device without hardware, behind a pseudo terminal."""

from __future__ import annotations

import shlex
from contextlib import nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from dcmp_hil.cli import console
from dcmp_hil.cli.options import Overrides, RigName

if TYPE_CHECKING:
    from typing import Any

    from dcmp_hil.config import Rig
    from dcmp_hil.platform.stop_request import StopRequest

_DEVICE_CLASS = "sim_backend.board.virtual_device:VirtualDevice"
_STATUS_PERIOD_S = 0.1  # between two looks at Ctrl-C, and two status lines
_RIG_NAME = "bench-1khz"
_RUN_WITH = {
    "cobs": ("backend.kind=serial", "backend.port={port}"),
    "slcan": ("backend.kind=can", "backend.interface=slcan", "backend.channel={port}"),
}


class LinkName(StrEnum):
    """Carriers of frames on the port."""

    COBS = "cobs"
    SLCAN = "slcan"


def device(
    rig: RigName = _RIG_NAME,
    overrides: Overrides = None,
    link: Annotated[LinkName, typer.Option(help="Carrier of the frames on the port.")] = LinkName.COBS,
    symlink: Annotated[
        Path | None,
        typer.Option(metavar="PATH", help="Symbolic link to the port, while the device runs."),
    ] = None,
) -> None:
    """Run a virtual device: the firmware's C code as a process, the simulated plant on its pins.

    The first line on standard output is the port, which a host opens like a serial port. Ctrl-C
    ends the device.
    """
    from dcmp_hil.config import load_rig
    from dcmp_hil.platform.clock import MonotonicClock
    from dcmp_hil.platform.stop_request import StopRequest
    from dcmp_hil.plugins.named_class import find_named

    loaded = load_rig(rig, overrides or ())
    make = find_named(_DEVICE_CLASS, "device")
    with (
        StopRequest() as stop,
        make(loaded, link=link.value, clock=MonotonicClock(), symlink=symlink) as running,
    ):
        port = str(symlink or running.port)
        console.out.print(port, highlight=False, markup=False)
        path = port if "/" in port else f"./{port}"  # without a slash it would be a serial number
        keys = [key.format(port=path) for key in _RUN_WITH[link]]
        console.note("", shlex.join(_run_command(rig, [*(overrides or ()), *keys])))
        _keep_running(running, loaded, stop)
    raise typer.Exit(stop.exit_code)


def _run_command(rig: str, overrides: list[str]) -> list[str]:
    named = [] if rig == _RIG_NAME else [rig]
    return ["dcmp-hil", "run", *named, *(part for key in overrides for part in ("--set", key))]


def _keep_running(running: Any, rig: Rig, stop: StopRequest) -> None:
    """Run the virtual device's ticks until the end is requested."""
    from rich.live import Live

    ticks = max(1, round(_STATUS_PERIOD_S / rig.period))
    terminal = console.err.is_terminal
    live = Live(console=console.err, auto_refresh=False, transient=True) if terminal else nullcontext()
    with live as line:
        while not stop.requested:
            running.run_ticks(ticks)
            if line is not None:
                line.update(_status(running), refresh=True)


def _status(running: Any) -> Text:
    from dcmp_hil.wire.messages import State

    output = running.output
    port = "open" if output.link_up else "closed"
    host = f"session {output.owner:04x}" if output.owner else "no session"
    return Text(
        f"tick {running.tick_count:9}  {port:6}  {State(output.state).name:6}  "
        f"{host:12}  {1e-3 * output.voltage_mV:+7.3f} V  {running.truth().position:+7.3f} rad",
        no_wrap=True,
        overflow="crop",
    )
