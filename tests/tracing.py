"""Coverage traces a test unless what the test runs is long and run by shorter tests, too.

Under Python 3.11 coverage calls a function at every line: the code of the loop takes two to three times as
long, and a process that is started takes half a second more.
"""

from __future__ import annotations

import os
import sys
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

MARKER = "untraced"
FOLDERS = tuple(
    f"tests/{name}/"
    for name in ("figures", "firmware", "install", "socketcan", "stateful", "target", "tools", "walk")
)
"""Folders whose tests are long, or run no line of the package that a test elsewhere does not."""

_OF_PROCESSES = "COVERAGE_PROCESS_CONFIG"  # set by coverage's patch of subprocess


@contextmanager
def untraced() -> Iterator[None]:
    """Run without coverage's tracer, in new threads and processes, too."""
    tracer, of_threads = sys.gettrace(), threading.gettrace()
    of_processes = os.environ.pop(_OF_PROCESSES, None)
    sys.settrace(None)
    threading.settrace(None)
    try:
        yield
    finally:
        threading.settrace(of_threads)
        sys.settrace(tracer)
        if of_processes is not None:
            os.environ[_OF_PROCESSES] = of_processes
