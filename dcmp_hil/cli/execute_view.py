"""Attaching a viewer to a run that is going on."""

from __future__ import annotations

from contextlib import suppress

from dcmp_hil.cli import console
from dcmp_hil.cli.viewer import web_viewer
from dcmp_hil.errors import ConfigError
from dcmp_hil.platform.clock import pause
from dcmp_hil.platform.display import display_problem
from dcmp_hil.telemetry.rerun import viewer as window

_POLL_PERIOD_S = 0.5  # s


def attach(port: int | None, *, web: bool) -> None:
    """Open a viewer on what is served on `port`, or on the only port that serves something.

    Raises
    ------
    ConfigError
        If nothing is served there, or there are several, or there is no display for a window.
    """
    place = find_served() if port is None else port
    if not window.speaks_http2(place):
        raise ConfigError(
            f"No run is served on {window.LOOPBACK}:{place}. Start one with: run --viewer serve"
        )
    if web:
        with suppress(KeyboardInterrupt), web_viewer(place):
            _until_it_ends(place)
    elif problem := display_problem():
        raise ConfigError(
            f"No window can be opened: {problem}. Use --web, or "
            f"from another computer: ssh -L {place}:{window.LOOPBACK}:{place} here, then rerun --connect "
            f"{window.proxy_url(place)} there."
        )
    else:
        window.start_viewer(place)
        console.note(f"opened {window.proxy_url(place)}; close the window when you like, the run goes on")


def find_served() -> int:
    """Return the port of the only run that is served on this computer.

    Raises
    ------
    ConfigError
        If there is none, or there are several.
    """
    ports = window.served()
    if not ports:
        raise ConfigError("No run is served on this computer. Start one with: dcmp-hil run --viewer serve")
    if len(ports) > 1:
        raise ConfigError(f"Several are served: {', '.join(map(str, ports))}. Name one with --port.")
    return ports[0]


def _until_it_ends(port: int) -> None:
    while window.speaks_http2(port):
        pause(_POLL_PERIOD_S)
