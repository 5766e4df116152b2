"""`dcmp-hil panel`: a page with sliders and STOP."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import urlsplit

import typer

from dcmp_hil.cli import console
from dcmp_hil.cli.live_commands import Run


def panel(
    port: Annotated[int, typer.Option(metavar="N", min=1, max=65535, help="Of 127.0.0.1.")] = 8710,
    run: Run = None,
    viewer: Annotated[
        str, typer.Option(metavar="URL", help="Address of a running web viewer, shown in the page.")
    ] = "",
    web: Annotated[
        bool, typer.Option("--web", help="Show the dashboard of a run with --viewer serve in the page.")
    ] = False,
) -> None:
    """Serve a page for this machine's browser: gains, reference, applied values, and STOP.

    The page finds the newest run, and the next one when that has ended. Only a browser that has the
    printed address, with its token, may use it.
    """
    from dcmp_hil.errors import ConfigError

    parts = urlsplit(viewer)
    if viewer and (parts.scheme not in {"http", "https"} or not parts.netloc):
        raise ConfigError(f"--viewer {viewer}: expected a URL such as http://127.0.0.1:9090.")
    if web:
        from dcmp_hil.cli.execute_view import find_served
        from dcmp_hil.cli.viewer import pages

        with pages(find_served()) as address:
            _serve(port, run, address)
    else:
        _serve(port, run, viewer)


def _serve(port: int, run: int | None, viewer: str) -> None:
    import asyncio
    from contextlib import suppress

    from dcmp_hil.errors import ConfigError

    try:
        from dcmp_hil.panel.server import Panel
    except ImportError:
        raise ConfigError("The panel needs aiohttp: pip install aiohttp") from None

    def ready(address: str) -> None:
        console.out.print(f"open {address}", highlight=False, markup=False)
        console.note("Ctrl-C ends the page; a run that goes on is not touched by that.")

    async def serve() -> None:
        await Panel(port, run, viewer).serve(ready)

    with suppress(KeyboardInterrupt):
        asyncio.run(serve())
