"""Head of a request, checked as bytes before any library parses it: malformed requests are refused."""

from __future__ import annotations

import re
from typing import NamedTuple

HEAD_BYTES_MAX = 1 << 13
"""Bytes of request line and header fields."""
BODY_BYTES_MAX = 1 << 14
"""Bytes of a body."""
_HEADERS_MAX = 64
_TARGET_CHARS_MAX = 2048  # characters
_HEAD_END = b"\r\n\r\n"
_FORBIDDEN_BYTES = re.compile(rb"[^\x20-\x7e\r\n\t]|(?<!\r)\n|\r[^\n]")
_HEADER_FIELD = re.compile(rb"([!#$%&'*+.^_`|~0-9A-Za-z-]+):[ \t]*(.*?)[ \t]*")
_REQUEST_LINE = re.compile(rb"([A-Z]{1,20}) (/[\x21-\x7e]*) HTTP/1\.[01]")
_METHODS = {b"GET", b"HEAD", b"POST"}
_UNIQUE_HEADERS = {b"host", b"content-length", b"origin", b"cookie", b"content-type"}
_REFUSED_HEADER_STATUS = {
    b"transfer-encoding": 411,
    b"content-encoding": 415,
    b"expect": 417,
    b"upgrade": 400,
}
_OF_CONNECTION = {b"connection", b"keep-alive", b"proxy-connection", b"te", b"trailer"}


class RequestError(Exception):
    """A malformed or refused request, and the status of its answer.

    Parameters
    ----------
    status
        Of the answer: 400 to 431.
    """

    def __init__(self, status: int = 400) -> None:
        super().__init__(status)
        self.status = status


class Head(NamedTuple):
    """Request line, headers and lengths of a request."""

    size: int  # bytes that it took
    method: bytes
    target: bytes
    fields: tuple[tuple[bytes, bytes], ...]
    length: int  # bytes of the body

    def alone(self) -> bytes:
        """Return it as a request that is the only one of its connection."""
        lines = [self.method + b" " + self.target + b" HTTP/1.1"]
        lines += [name + b": " + value for name, value in self.fields if name.lower() not in _OF_CONNECTION]
        return b"\r\n".join([*lines, b"Connection: close", b"", b""])


def head_of(data: bytes) -> Head | None:
    """Return the head of a request; None as long as more of it is to come.

    Raises
    ------
    RequestError
        If this server answers no such request, with any body.
    """
    end = data.find(_HEAD_END)
    head = data[: end + 2] if end >= 0 else data
    if len(head) > HEAD_BYTES_MAX:
        raise RequestError(431)
    if _FORBIDDEN_BYTES.search(head):
        raise RequestError
    if end < 0:
        return None
    first, *lines = head[:-2].split(b"\r\n")
    method, target = _request_line(first)
    fields = _fields(lines)
    return Head(end + len(_HEAD_END), method, target, fields, _length(method, fields))


def _request_line(line: bytes) -> tuple[bytes, bytes]:
    found = _REQUEST_LINE.fullmatch(line)
    if found is None:
        raise RequestError
    method, target = found.groups()
    if method not in _METHODS:
        raise RequestError(405)
    if len(target) > _TARGET_CHARS_MAX:
        raise RequestError(414)
    return method, target


def _fields(lines: list[bytes]) -> tuple[tuple[bytes, bytes], ...]:
    if len(lines) > _HEADERS_MAX:
        raise RequestError(431)
    fields = []
    for line in lines:
        found = _HEADER_FIELD.fullmatch(line)
        if found is None:
            raise RequestError
        fields.append((found[1], found[2]))
    names = [name.lower() for name, _ in fields]
    for name in names:
        if name in _REFUSED_HEADER_STATUS:
            raise RequestError(_REFUSED_HEADER_STATUS[name])
        if name in _UNIQUE_HEADERS and names.count(name) > 1:
            raise RequestError
    if b"host" not in names:
        raise RequestError
    return tuple(fields)


def _length(method: bytes, fields: tuple[tuple[bytes, bytes], ...]) -> int:
    given = next((value for name, value in fields if name.lower() == b"content-length"), b"0")
    if not given.isdigit():
        raise RequestError
    if len(given) > len(str(BODY_BYTES_MAX)) or int(given) > BODY_BYTES_MAX:
        raise RequestError(413)
    length = int(given)
    if length and method != b"POST":
        raise RequestError
    return length
