"""Ways to watch a run: a window, a page in a browser, whoever comes and goes."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from dcmp_hil.cli import console
from dcmp_hil.telemetry import viewer as window
from dcmp_hil.telemetry.display import display_available

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.telemetry.rerun_sink import Viewer

_START = 5.0  # s, until the pages are served
_ENDING = 1.0  # s


@contextmanager
def watched(viewer: Viewer) -> Iterator[tuple[Viewer, int]]:
    """Tell where a run will be seen, and serve pages as long as it lasts.

    Yields
    ------
    tuple
        How it is watched after all, and the port that its recording is to be served on.
    """
    if viewer not in {"serve", "web"}:
        yield viewer, window.PORT
        return
    port = window.free_port()
    if port is None:
        console.warn(
            f"No port from {window.PORT} on is free on {window.LOOPBACK}: the run goes on and nobody can "
            "watch. Close viewers that are no longer needed."
        )
        yield "none", window.PORT
    elif viewer == "serve":
        console.note(f"to watch: dcmp-hil view, or rerun --connect {window.proxy_url(port)}")
        yield viewer, port
    else:
        with web_viewer(port):
            yield viewer, port


@contextmanager
def web_viewer(port: int) -> Iterator[None]:
    """Serve the web viewer of what is served on `port`, and tell its address; without it life goes on."""
    with pages(port) as address:
        if address:
            console.note(f"web viewer: {address}")
            open_browser(address)
        yield


@contextmanager
def pages(port: int) -> Iterator[str]:
    """Serve the web viewer of what is served on `port`; yield its address, nothing where that fails."""
    process, problem = None, ""
    web_port = window.free_port(window.WEB_PORT)
    if web_port is None:
        problem = f"no port from {window.WEB_PORT} on is free on {window.LOOPBACK}"
    else:
        try:
            process = window.start_web_viewer(web_port, port)
        except OSError as error:
            problem = str(error)
        else:
            problem = "" if window.answers(web_port, _START) else "its pages are not served"
    if problem:
        console.warn(f"No web viewer ({problem}); to watch: dcmp-hil view")
    try:
        yield "" if problem or web_port is None else window.web_url(web_port, port)
    finally:
        if process is not None:
            process.terminate()
            process.wait(_ENDING)


def open_browser(address: str) -> None:
    """Open a page where there is a display; where there is no browser the address is on the screen."""
    if not display_available():
        return
    import webbrowser

    if not webbrowser.open(address):
        console.warn("No browser was found; open the address above in one.")
