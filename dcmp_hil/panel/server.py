"""The page's server: on 127.0.0.1 only, a stream of states one way, changes and STOP the other."""

from __future__ import annotations

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from html import escape
from importlib import resources
from typing import TYPE_CHECKING, Any

from aiohttp import web

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.client import change, stop
from dcmp_hil.panel.guard import Guard
from dcmp_hil.panel.watcher import Watcher

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable

_PAGE = resources.files("dcmp_hil.panel").joinpath("page")
_FILES = {"/": "text/html", "/panel.css": "text/css", "/panel.js": "text/javascript"}
_EVERY = 0.15  # s between two states that a page is sent
_LONGEST = 1 << 14  # bytes of a request
_NO_RUN = "There is no run."


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
        self.guard = Guard(port, viewer)
        self._port, self._viewer = port, viewer
        self._watcher = Watcher(pid)
        self._stopping = ThreadPoolExecutor(2)  # STOP queues behind nothing
        self._ending = asyncio.Event()

    def application(self) -> web.Application:
        """Make what answers requests."""

        @web.middleware
        async def check(request: web.Request, handler: Any) -> web.StreamResponse:
            return await self.guard.check(request, handler)

        app = web.Application(middlewares=[check], client_max_size=_LONGEST)
        app.on_response_prepare.append(self.guard.add_headers)
        app.cleanup_ctx.append(self._watching)
        app.on_shutdown.append(self._end)
        app.add_routes([web.get(path, self._file) for path in _FILES])
        app.add_routes([web.get("/events", self._events)])
        app.add_routes([web.post("/set", self._set), web.post("/stop", self._stop)])
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
        try:
            await web.TCPSite(runner, "127.0.0.1", self._port).start()
            ready(self.guard.address)
            await asyncio.Event().wait()
        except OSError as error:
            raise ConfigError(
                f"--port {self._port}: {error.strerror}. Choose another, or end what uses it."
            ) from None
        finally:
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
        name = request.path.removeprefix("/") or "index.html"
        text = _PAGE.joinpath(name).read_text("utf-8")
        if name == "index.html":
            text = text.replace("{{viewer}}", escape(self._viewer))
        return web.Response(text=text, content_type=_FILES[request.path])

    async def _events(self, request: web.Request) -> web.StreamResponse:
        answer = web.StreamResponse(headers={"Content-Type": "text/event-stream"})
        await answer.prepare(request)
        try:
            while not self._ending.is_set():
                await answer.write(f"data: {json.dumps(self._watcher.state)}\n\n".encode())
                await asyncio.sleep(_EVERY)
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

    async def _stop(self, _: web.Request) -> web.Response:
        run = self._watcher.run
        if run is None:
            return _said(ok=False, said=_NO_RUN)
        try:
            await asyncio.get_running_loop().run_in_executor(self._stopping, stop, run)
        except ConfigError as error:
            return _said(ok=False, said=str(error))
        return _said(ok=True, said="STOP: the run ends at 0 V")


async def _changes_in(request: web.Request) -> list[str] | None:
    """Return what a request wants changed; None if it is no list of texts."""
    try:
        body = await request.json()
    except ValueError:
        return None
    changes = body.get("changes") if isinstance(body, dict) else None
    good = isinstance(changes, list) and all(isinstance(one, str) for one in changes)
    return changes if good else None


def _said(*, ok: bool, said: str, status: int = 200) -> web.Response:
    return web.json_response({"ok": ok, "said": said}, status=status)
