"""`dcmp-hil view`: look at a run that is going on; closing the window leaves the run as it is."""

from __future__ import annotations

from typing import Annotated

import typer


def view(
    port: Annotated[
        int | None, typer.Option("--port", metavar="N", help="Port of the run; found automatically.")
    ] = None,
    web: Annotated[
        bool, typer.Option("--web", help="In a browser, until Ctrl-C, instead of a window.")
    ] = False,
) -> None:
    """Attach a viewer to a run with --viewer spawn, serve or web."""
    from dcmp_hil.cli.execute_view import attach

    attach(port, web=web)
