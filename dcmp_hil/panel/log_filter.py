"""Log lines of the web server's libraries: one of a kind, without a traceback, for any request."""

from __future__ import annotations

import logging
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Iterator

_LOGGER_NAMES = ("aiohttp.server", "aiohttp.web", "aiohttp.internal", "aiohttp.access", "asyncio")
_LINE_KINDS_MAX = 20  # of lines


class _OnceEach(logging.Filter):
    """Lets the first line of each kind pass."""

    def __init__(self) -> None:
        super().__init__()
        self._seen: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a line is the first of its kind; its traceback is left out."""
        error = record.exc_info[0] if record.exc_info else None
        kind = f"{record.name} {record.msg[:80] if isinstance(record.msg, str) else ''} {error}"
        if kind in self._seen or len(self._seen) >= _LINE_KINDS_MAX:
            return False
        self._seen.add(kind)
        if error is not None:
            record.msg, record.args = f"{str(record.msg)[:80]} ({error.__name__})", ()
        record.exc_info = record.exc_text = record.stack_info = None
        return True


@contextmanager
def quiet(loop: asyncio.AbstractEventLoop) -> Iterator[None]:
    """Limit the log messages of the web server while `loop` serves."""
    once = _OnceEach()
    log = logging.getLogger("asyncio")

    def told(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        log.error("%s (%s)", context.get("message", "an error"), type(error).__name__)

    for name in _LOGGER_NAMES:
        logging.getLogger(name).addFilter(once)
    loop.set_exception_handler(told)
    try:
        yield
    finally:
        loop.set_exception_handler(None)
        for name in _LOGGER_NAMES:
            logging.getLogger(name).removeFilter(once)
