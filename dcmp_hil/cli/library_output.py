"""Lines that are not the run's own: kept in its folder, and off the terminal."""

from __future__ import annotations

import logging
import os
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from dcmp_hil.cli import streams
from dcmp_hil.platform.process_log import STDERR_FILENO, descriptor_of_stderr

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@contextmanager
def split_stderr(path: Path | None) -> Iterator[None]:
    """Send to `path` what is written to descriptor 2, logged, or given as a Python warning.

    `sys.stderr` goes on to where it went before. The file is removed again where nothing was written.

    Parameters
    ----------
    path
        The file; None keeps nothing of it, and so does one that cannot be made.
    """
    if descriptor_of_stderr() != STDERR_FILENO:  # a program that calls us put another stream there
        yield
        return
    before = sys.stderr
    before.flush()
    terminal, file = os.dup(STDERR_FILENO), _opened(path)
    os.dup2(file, STDERR_FILENO)
    os.close(file)
    sys.stderr = streams.text_on(terminal)
    handler = logging.StreamHandler(before)
    logging.getLogger().addHandler(handler)
    logging.captureWarnings(capture=True)
    try:
        yield
    finally:
        logging.captureWarnings(capture=False)
        logging.getLogger().removeHandler(handler)
        before.flush()
        sys.stderr.flush()
        os.dup2(terminal, STDERR_FILENO)
        sys.stderr = before
        os.close(terminal)
        if path is not None:
            _remove_if_empty(path)


def _opened(path: Path | None) -> int:
    if path is not None:
        with suppress(OSError):
            return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    return os.open(os.devnull, os.O_WRONLY)


def _remove_if_empty(path: Path) -> None:
    with suppress(OSError):
        if not path.stat().st_size:
            path.unlink()
