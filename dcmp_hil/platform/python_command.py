"""Command line of a Python process that runs a few lines of code."""

from __future__ import annotations

import sys


def python_command(code: str, *arguments: str, isolated: bool = False) -> list[str]:
    """Return the command that runs `code` in a process of this interpreter.

    Parameters
    ----------
    code
        Lines of Python.
    arguments
        Its `sys.argv[1:]`.
    isolated
        Whether it starts without environment variables, the user's folder and installed packages, which
        takes half the time.
    """
    options = ["-I", "-S"] if isolated else []
    return [sys.executable, *options, "-c", code, *arguments]
