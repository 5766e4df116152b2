"""The page's server: on 127.0.0.1 only, a stream of states one way, changes and STOP the other.

What reaches it came through `ConnectionLimiter`: whole requests, few at a time.
"""

from __future__ import annotations

import asyncio
import json
import socket
from concurrent.futures import ThreadPoolExecutor
from html import escape
from importlib import resources
from typing import TYPE_CHECKING, Any

from aiohttp import web

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.client import change, stop
from dcmp_hil.live.envelopes import BUCKETS_PER_LINE_MAX
from dcmp_hil.live.stop_command import End
from dcmp_hil.panel.access_control import AccessControl
from dcmp_hil.panel.admission import BACKLOG_MAX, ConnectionLimiter, Visit
from dcmp_hil.panel.log_filter import quiet
from dcmp_hil.panel.request_head import BODY_BYTES_MAX
from dcmp_hil.panel.rig_file import RigFiles
from dcmp_hil.panel.run_follower import Watcher
from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

_MODULES = ("asking", "knobs", "marks", "panel", "phase", "plots", "rig_file", "stop", "tiles", "trace")
_STATE_PERIOD_S = 0.15  # s between two states that a page is sent
_ACCEPT_QUEUE_MAX = 1024  # connections that the kernel keeps while this process is busy
_STOP_AGE_MAX_S = 1.0  # s: a STOP that is older was pressed for something that has passed, or for another run
_NO_RUN = "There is no run."
_OWN = resources.files("dcmp_hil.panel").joinpath("page")
_UPLOT = resources.files("dcmp_hil").joinpath("vendor", "uplot")
_FILES = {
    "/": (_OWN.joinpath("index.html"), "text/html"),
    "/panel.css": (_OWN.joinpath("panel.css"), "text/css"),
    **{f"/{name}.js": (_OWN.joinpath(f"{name}.js"), "text/javascript") for name in _MODULES},
    "/uplot.css": (_UPLOT.joinpath("uPlot.min.css"), "text/css"),
    "/uplot.js": (_UPLOT.joinpath("uPlot.iife.min.js"), "text/javascript"),
}


class Panel:
    """Serves the page of one run after the other.

    Parameters
    ----------
    port
        Of 127.0.0.1.
    pid
        Of the run that is meant; None takes the newest.
    viewer
        URL of a web viewer for the page's frame; empty for none.
    """

    def __init__(self, port: int, pid: int | None = None, viewer: str = "") -> None:
        self.access = AccessControl(port, viewer)
        self._port, self._viewer = port, viewer
        self._watcher = Watcher(pid)
        self._rig_files = RigFiles()
        self._stopping = ThreadPoolExecutor(2)  # STOP queues behind nothing
        self._stop_of: dict[
            int, asyncio.Task[str]
        ] = {}  # by run: a second STOP waits for the first one's answer
        self._ending = asyncio.Event()

    def application(self) -> web.Application:
        """Return the web application that answers the requests."""

        @web.middleware
        async def check(request: web.Request, handler: Any) -> web.StreamResponse:
            return await self.access.check(request, handler)

        app = web.Application(middlewares=[check], client_max_size=BODY_BYTES_MAX)
        app.on_response_prepare.append(self.access.add_headers)
        app.cleanup_ctx.append(self._watching)
        app.on_shutdown.append(self._end)
        app.add_routes([web.get(path, self._file) for path in _FILES])
        app.add_routes([web.get("/events", self._events)])
        app.add_routes([web.post("/set", self._set), web.post("/stop", self._stop)])
        app.add_routes([web.post("/rig-diff", self._rig_diff), web.post("/rig-write", self._rig_write)])
        return app

    async def serve(self, ready: Callable[[str], None]) -> None:
        """Serve until cancelled; `ready` is told the address.

        Raises
        ------
        ConfigError
            If the port is in use.
        """
        runner = web.AppRunner(self.application(), access_log=None, shutdown_timeout=0.5)
        await runner.setup()
        assert runner.server is not None  # noqa: S101 - `setup` made it
        loop = asyncio.get_running_loop()
        limiter = ConnectionLimiter(runner.server, self.access.token)
        server = None
        with quiet(loop):
            try:
                server = await loop.create_server(limiter, "127.0.0.1", self._port, backlog=BACKLOG_MAX)
                for listening in server.sockets:
                    _keep_more_waiting(listening)
                ready(self.access.address)
                await asyncio.Event().wait()
            except OSError as error:
                raise ConfigError(
                    f"--port {self._port}: {error.strerror}. Choose another, or end what uses it."
                ) from None
            finally:
                if server is not None:
                    server.close()
                await runner.cleanup()

    async def _watching(self, _: web.Application) -> AsyncIterator[None]:
        task = asyncio.ensure_future(self._watcher.watch())
        yield
        task.cancel()
        await asyncio.wait({task})
        self._stopping.shutdown(wait=False)

    async def _end(self, _: web.Application) -> None:
        self._ending.set()

    async def _file(self, request: web.Request) -> web.Response:
        file, kind = _FILES[request.path]
        text = file.read_text("utf-8")
        if request.path == "/":
            text = text.replace("{{viewer}}", escape(self._viewer))
        return web.Response(text=text, content_type=kind)

    async def _events(self, request: web.Request) -> web.StreamResponse:
        answer = web.StreamResponse(headers={"Content-Type": "text/event-stream"})
        await answer.prepare(request)
        place = 0
        try:
            while not self._ending.is_set():
                place, buckets = self._watcher.history.after(place)
                state = {**self._watcher.state, "buckets": buckets, "server_ms": _now_ms()}
                await answer.write(f"data: {json.dumps(state, allow_nan=False)}\n\n".encode())
                if len(buckets) < BUCKETS_PER_LINE_MAX:
                    await asyncio.sleep(_STATE_PERIOD_S)
        except ConnectionError:  # the page was closed
            pass
        return answer

    async def _set(self, request: web.Request) -> web.Response:
        changes = await _changes_in(request)
        if changes is None:
            return _said(ok=False, said="A change is a list of KEY=VALUE.", status=400)
        run = self._watcher.run
        if run is None:
            return _said(ok=False, said=_NO_RUN)
        try:
            return _said(ok=True, said=await asyncio.to_thread(change, run, changes))
        except ConfigError as error:
            return _said(ok=False, said=str(error))

    async def _rig_diff(self, _: web.Request) -> web.Response:
        """Answer with what would put the values of the run, or of the last one, into its rig file."""
        state = self._watcher.state
        source, values = state.get("source"), state.get("values")
        if not source or values is None:
            return _said(ok=False, said="There is no run whose rig has a name or a file.")
        try:
            found = await asyncio.to_thread(self._rig_files.propose, source, values, state.get("tables"))
        except ConfigError as error:
            return _said(ok=False, said=str(error))
        return web.json_response({"ok": True, "said": "", "source": source, **found})

    async def _rig_write(self, request: web.Request) -> web.Response:
        body = await _json(request)
        number = body.get("proposal") if isinstance(body, dict) else None
        if not isinstance(number, str):
            return _said(ok=False, said="What is accepted is named by its number.", status=400)
        try:
            return _said(ok=True, said=f"wrote {await asyncio.to_thread(self._rig_files.accept, number)}")
        except ConfigError as error:
            return _said(ok=False, said=str(error))

    async def _stop(self, request: web.Request) -> web.Response:
        """Stop the run, unless the STOP waited for longer than a second on its way here."""
        pressed_ms = await _pressed_ms(request)
        run = self._watcher.run
        if run is None:
            return _said(ok=False, said=_NO_RUN)
        if run not in self._stop_of:
            task = asyncio.ensure_future(self._stop_fresh(run, pressed_ms))
            self._stop_of[run] = task
            task.add_done_callback(lambda _: self._stop_of.pop(run, None))
        try:
            return _said(ok=True, said=await asyncio.shield(self._stop_of[run]))
        except ConfigError as error:
            return _said(ok=False, said=str(error))

    async def _stop_fresh(self, run: int, pressed_ms: float) -> str:
        def stop_it() -> str:
            waited = 1e-3 * (_now_ms() - pressed_ms)
            if waited > _STOP_AGE_MAX_S:
                raise ConfigError(
                    f"STOP not confirmed: it waited for {waited:.1f} s and was dropped. Press it again."
                )
            stopped = stop(run)
            if stopped.end is End.FAILED:
                raise ConfigError(stopped.said)
            return f"STOP: {stopped.said}"

        return await asyncio.get_running_loop().run_in_executor(self._stopping, stop_it)


def _now_ms() -> float:
    """Return ms on the monotonic clock: what a page is told, and counts on from."""
    return 1e-6 * MonotonicClock().now_ns()


def _keep_more_waiting(listening: socket.socket) -> None:
    """Enlarge the kernel's queue of connections."""
    again = socket.fromfd(listening.fileno(), socket.AF_INET, socket.SOCK_STREAM)
    with again:
        again.listen(_ACCEPT_QUEUE_MAX)


async def _pressed_ms(request: web.Request) -> float:
    """Return when STOP was pressed: as the page says, else when its connection was taken."""
    transport = request.transport
    visit = transport.get_protocol() if transport is not None else None
    arrived_ms = 1e-6 * visit.arrived_ns if isinstance(visit, Visit) else _now_ms()
    body = await _json(request)
    said = body.get("pressed_ms") if isinstance(body, dict) else None
    return min(arrived_ms, said) if isinstance(said, int | float) else arrived_ms


async def _json(request: web.Request) -> Any:
    """Return the body; None if it is no JSON. Its charset is not asked: JSON is UTF-8."""
    try:
        return json.loads(await request.read())
    except (ValueError, RecursionError):
        return None


async def _changes_in(request: web.Request) -> list[str] | None:
    """Return what a request wants changed; None if it is no list of texts."""
    body = await _json(request)
    changes = body.get("changes") if isinstance(body, dict) else None
    good = isinstance(changes, list) and all(isinstance(one, str) for one in changes)
    return changes if good else None


def _said(*, ok: bool, said: str, status: int = 200) -> web.Response:
    return web.json_response({"ok": ok, "said": said}, status=status)
