"""Ways to watch a run: a window, a page in a browser, viewers that come and go."""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from dcmp_hil.cli import console
from dcmp_hil.platform.display import display_available, display_problem
from dcmp_hil.platform.other_users import others_here
from dcmp_hil.telemetry.rerun import viewer as window

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.telemetry.dispatcher import Sink
    from dcmp_hil.telemetry.rerun.sink import RerunSink, Viewer
    from dcmp_hil.values import Event

_START_TIMEOUT_S = 60.0  # s, a far limit: that the pages are served is an event


def chosen(viewer: Viewer | None) -> Viewer:
    """Return how a run is shown: as asked for, else in a window where one can be opened.

    A display that was asked for, or is announced, and cannot be opened costs a warning: then there is a
    picture, as without a display.
    """
    if viewer not in {None, "spawn"}:
        return viewer
    if viewer is None and not display_available():
        return "none"
    problem = display_problem()
    if not problem:
        return "spawn"
    console.warn(f"No viewer window: {problem}. To watch in a browser: --viewer web.")
    return "none"


def watched(sink: RerunSink, viewer: Viewer) -> Sink:
    """Report the address at which a run is served, and serve pages until it ends."""
    if sink.port is not None and others_here():
        console.note(
            f"every user of this computer can connect to the dashboard on port {sink.port}, read it, and "
            "show things in it; it is served no more where one does. The run's files take nothing from it."
        )
    if sink.port is None or viewer not in {"serve", "web"}:
        return sink
    if viewer == "serve":
        console.note(f"to watch: dcmp-hil view, or rerun --connect {window.proxy_url(sink.port)}")
        return sink
    return _WithPages(sink, sink.port)


class _WithPages:
    """A sink whose pages are served until it is closed."""

    def __init__(self, sink: RerunSink, port: int) -> None:
        self._sink = sink
        self.warnings = sink.warnings
        self._pages = ExitStack()
        self._pages.enter_context(web_viewer(port))

    def block(self, block: Block) -> None:
        """Process a block of consecutive cycles."""
        self._sink.block(block)

    def event(self, event: Event) -> None:
        """Process an event."""
        self._sink.event(event)

    def close(self) -> None:
        """Stop serving pages, and close the sink."""
        self._pages.close()  # first: the other may take its time, and this process may be ended meanwhile
        self._sink.close()


@contextmanager
def web_viewer(port: int) -> Iterator[None]:
    """Serve the web viewer of what is served on `port`, and tell its address; a failure is a warning."""
    with pages(port) as address:
        if address:
            console.note("web viewer:", address)
            open_browser(address)
        yield


@contextmanager
def pages(port: int) -> Iterator[str]:
    """Serve the web viewer of what is served on `port`; yield its address, nothing where that fails."""
    problem = f"no port from {window.WEB_PORT} on is free on {window.LOOPBACK}"
    process, address = None, ""
    try:
        for web_port in window.free_ports(window.WEB_PORT):
            try:
                process = window.start_web_viewer(web_port, port)
            except OSError as error:
                problem = str(error)
                break
            if window.serves(web_port, process.pid, _START_TIMEOUT_S):
                address = window.web_url(web_port, port)
                break
            process.kill()  # another process took the port first
            problem = f"its pages are not served, exit code {process.wait()}"
        if not address:
            console.warn(f"No web viewer ({problem}); to watch: dcmp-hil view")
        yield address
    finally:  # after Ctrl-C while it starts, too
        if process is not None:
            process.kill()  # it keeps nothing, and the telemetry process has it ignore SIGTERM
            process.wait()


def open_browser(address: str) -> None:
    """Open a page where there is a display; where there is no browser the address is on the screen."""
    if not display_available() or display_problem():
        return
    import webbrowser

    if not webbrowser.open(address):
        console.warn("No browser was found; open the address above in one.")
