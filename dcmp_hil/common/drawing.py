"""Matplotlib for pictures in files: settings for windows have no effect."""

from __future__ import annotations

import logging
import os
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_BACKEND = "MPLBACKEND"


@contextmanager
def files_only() -> Iterator[None]:
    """Allow Matplotlib's import and use without its backend for windows and its log on a terminal.

    Its import fails where MPLBACKEND names a backend that does not exist, and it logs on standard error that
    a home folder cannot be written, or that it looks for fonts.
    """
    backend = os.environ.pop(_BACKEND, None)
    log = logging.getLogger("matplotlib")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)
        if backend is not None:
            os.environ[_BACKEND] = backend
