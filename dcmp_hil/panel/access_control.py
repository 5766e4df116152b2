"""Access to the page: requests with the token of its address, from a page that came from here."""

from __future__ import annotations

import hmac
import secrets
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from aiohttp import web

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]

_CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
    "frame-src {frames}; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)


class AccessControl:
    """Checks host, origin and token of every request, and says in every answer what the page may load.

    Parameters
    ----------
    port
        Where the page is served.
    viewer
        URL of what is shown in its frame; empty for none.

    Attributes
    ----------
    token
        Random; a request that carries it may use the page.
    """

    def __init__(self, port: int, viewer: str) -> None:
        self.token = secrets.token_urlsafe(24)
        self._cookie = f"dcmp_hil_{port}"  # cookies do not tell ports apart
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self._port = port
        parts = urlsplit(viewer)
        self._headers = {
            "Content-Security-Policy": _CONTENT_SECURITY_POLICY.format(
                frames=f"{parts.scheme}://{parts.netloc}" if viewer else "'none'"
            ),
            "Cache-Control": "no-store",
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "no-referrer",
        }

    @property
    def address(self) -> str:
        """Address of the page, with its token, for a browser."""
        return f"http://127.0.0.1:{self._port}/?token={self.token}"

    async def check(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Pass a request with the right host, origin and token to `handler`; refuse any other."""
        refusal = self._refusal(request)
        if refusal:
            raise web.HTTPForbidden(text=refusal, headers=self._headers)
        if request.method == "GET" and request.path == "/" and "token" in request.query:
            return self._let_in()
        return await handler(request)

    async def add_headers(self, _: web.Request, response: web.StreamResponse) -> None:
        """Add the headers that restrict what the page may load."""
        response.headers.update(self._headers)

    def _let_in(self) -> web.Response:
        """Exchange the token in the address for a cookie, so that it stays in no history."""
        answer = web.Response(status=303, headers={"Location": "/"})
        answer.set_cookie(self._cookie, self.token, httponly=True, samesite="Strict", path="/")
        return answer

    def _refusal(self, request: web.Request) -> str:
        if request.host not in self._hosts:
            return "Another host than this machine."
        origin = request.headers.get("Origin")
        if origin is None and request.method != "GET":
            return "No origin."
        if origin is not None and origin not in {f"http://{host}" for host in self._hosts}:
            return "Another origin than this page."
        given = request.query.get("token") or request.cookies.get(self._cookie, "")
        if not hmac.compare_digest(given.encode(errors="replace"), self.token.encode()):
            return "Open the address that `dcmp-hil panel` printed: it holds the token that is missing here."
        return ""
