"""The way in: bounded numbers of connections, bytes and seconds, so that STOP gets through a crowd.

A connection is one request. It costs a few bytes until the request is there whole and well-formed; only then
does the server see it. Where there are too many, the one that has been silent for longest goes, never a STOP.
"""

from __future__ import annotations

import asyncio
from http import HTTPStatus
from typing import TYPE_CHECKING

from dcmp_hil.panel.request_head import RequestError, head_of
from dcmp_hil.platform.clock import MonotonicClock

if TYPE_CHECKING:
    from collections.abc import Callable

    from dcmp_hil.panel.request_head import Head

WAITING_MAX, SERVED_MAX = 256, 64
"""Connections without a whole request, and with one."""
BACKLOG_MAX = 64
"""Connections that are taken from the kernel at once: fewer than may wait, so that each can speak."""
_REQUEST_TIMEOUT_S = 2.0  # s for a whole request
_REFUSAL_TIMEOUT_S = 0.5  # s for a refused client to take its answer
_REQUESTS_WITHOUT_TOKEN_1_S = 100.0  # requests a second
_REQUESTS_WITH_TOKEN_1_S = 300.0  # requests a second
_STOP_PATH = b"/stop"


class TokenBucket:
    """So many a second, and as many at once.

    Parameters
    ----------
    rate
        1/s.
    """

    def __init__(self, rate: float) -> None:
        self._rate = self._left = rate
        self._clock = MonotonicClock()
        self._at_ns = self._clock.now_ns()

    def take(self) -> bool:
        """Take one token; return False if none is left."""
        now_ns = self._clock.now_ns()
        self._left = min(self._rate, self._left + 1e-9 * (now_ns - self._at_ns) * self._rate)
        self._at_ns = now_ns
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class ConnectionLimiter:
    """Makes the protocol of each connection.

    Parameters
    ----------
    make
        Makes what answers one request, a protocol of its own.
    token
        Without it, requests are few.
    """

    def __init__(self, make: Callable[[], asyncio.Protocol], token: str) -> None:
        self.make = make
        self._token = token.encode()
        self._waiting: dict[Visit, None] = {}
        self._served: dict[Visit, None] = {}
        self._strangers, self._friends = (
            TokenBucket(_REQUESTS_WITHOUT_TOKEN_1_S),
            TokenBucket(_REQUESTS_WITH_TOKEN_1_S),
        )

    def __call__(self) -> Visit:
        """Make the protocol of a new connection."""
        return Visit(self)

    def admit(self, visit: Visit) -> None:
        """Admit a new connection; close the oldest one without a request if there are too many."""
        if len(self._waiting) >= WAITING_MAX:
            next(iter(self._waiting)).drop()
        self._waiting[visit] = None

    def refusal(self, visit: Visit, head: Head, request: bytes) -> int:
        """Return the status with which a complete request is refused; 0 if it is admitted."""
        known = self._token in request
        if known and head.method == b"POST" and head.target == _STOP_PATH:
            visit.is_stop = True
        elif not (self._friends if known else self._strangers).take():
            return HTTPStatus.TOO_MANY_REQUESTS
        if len(self._served) >= SERVED_MAX:
            oldest = next((one for one in self._served if not one.is_stop), None)
            if oldest is None:
                return HTTPStatus.SERVICE_UNAVAILABLE
            oldest.drop()
        self._waiting.pop(visit, None)
        self._served[visit] = None
        return 0

    def forget(self, visit: Visit) -> None:
        """Count a connection no more."""
        self._waiting.pop(visit, None)
        self._served.pop(visit, None)


class Visit(asyncio.Protocol):
    """A connection: collects a request, passes it on, and closes after the answer.

    Attributes
    ----------
    arrived_ns
        When it was taken, on the monotonic clock.
    is_stop
        Whether it brought a STOP with the token.
    """

    def __init__(self, limiter: ConnectionLimiter) -> None:
        self.arrived_ns = MonotonicClock().now_ns()
        self.is_stop = False
        self._limiter = limiter
        self._data = bytearray()
        self._refused = False
        self._head: Head | None = None
        self._answering: asyncio.Protocol | None = None
        self._transport: asyncio.Transport | None = None
        self._late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Wait for its request."""
        assert isinstance(transport, asyncio.Transport)  # noqa: S101 - of a stream, as the server made it
        self._transport = transport
        self._late = asyncio.get_running_loop().call_later(
            _REQUEST_TIMEOUT_S, self._refuse, HTTPStatus.REQUEST_TIMEOUT
        )
        self._limiter.admit(self)

    def data_received(self, data: bytes) -> None:
        """Collect the bytes of a request; bytes behind it are not read."""
        if self._answering is not None or self._refused or self._transport is None:
            return
        self._data += data
        try:
            self._head = self._head or head_of(bytes(self._data))
        except RequestError as bad:
            self._refuse(bad.status)
            return
        if self._head is not None and len(self._data) >= self._head.size + self._head.length:
            self._serve(self._head)

    def eof_received(self) -> bool:
        """Refuse a request that is not complete at the end of the input."""
        if self._answering is None:
            self._refuse(HTTPStatus.BAD_REQUEST)
        return self._answering is not None

    def pause_writing(self) -> None:
        """Make the answering task wait until the client has read more."""
        if self._answering is not None:
            self._answering.pause_writing()

    def resume_writing(self) -> None:
        """Let the answering task go on writing."""
        if self._answering is not None:
            self._answering.resume_writing()

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell the limiter that the connection is closed."""
        self._limiter.forget(self)
        self._transport = None
        self._settled()
        if self._answering is not None:
            self._answering.connection_lost(exc)

    def drop(self) -> None:
        """Close at once."""
        self._limiter.forget(self)
        self._settled()
        if self._transport is not None:
            self._transport.abort()

    def _serve(self, head: Head) -> None:
        assert self._transport is not None  # noqa: S101 - `data_received` looked
        request = head.alone() + bytes(self._data[head.size : head.size + head.length])
        status = self._limiter.refusal(self, head, request)
        if status:
            self._refuse(status)
            return
        self._settled()
        self._data.clear()
        self._answering = self._limiter.make()
        self._answering.connection_made(self._transport)
        self._answering.data_received(request)

    def _refuse(self, status: int) -> None:
        transport = self._transport
        if transport is None or transport.is_closing() or self._refused:
            return
        self._settled()
        if not self._data:  # a browser opens connections that it never uses
            transport.close()
            return
        self._refused = True
        reason = HTTPStatus(status).phrase
        transport.write(
            f"HTTP/1.1 {int(status)} {reason}\r\nContent-Type: text/plain\r\n"
            f"Content-Length: {len(reason)}\r\nConnection: close\r\n\r\n{reason}".encode()
        )
        transport.write_eof()  # closed at once, with bytes unread, it would take the answer back
        self._late = asyncio.get_running_loop().call_later(_REFUSAL_TIMEOUT_S, transport.abort)

    def _settled(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None
