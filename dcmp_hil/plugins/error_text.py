"""Errors of a user's class: one line, with file and line number."""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import TracebackType

_PACKAGE_FOLDER = str(Path(__file__).parent)
_SHOWN_CHARS_MAX = 300  # characters of a message
_SHOWN_VALUE_CHARS_MAX = 60
REMEDY = "Correct it there."


def message_of(error: BaseException) -> str:
    """Return type and message of an error in one line."""
    try:
        text = " ".join(str(error).split())
    except Exception:  # noqa: BLE001 - its __str__ is the user's own code, too
        text = ""
    if len(text) > _SHOWN_CHARS_MAX:
        text = f"{text[:_SHOWN_CHARS_MAX]} ..."
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def syntax_of(error: SyntaxError) -> str:
    """Return file, line and message of a syntax error."""
    line = f", line {error.lineno}" if error.lineno else ""
    text = f": {error.text.strip()[:_SHOWN_VALUE_CHARS_MAX]}" if error.text and error.text.strip() else ""
    return f"{shown_path(error.filename or 'source')}{line}: {error.msg}{text}"


def place_of(error: BaseException, file: str | None = None) -> str:
    """Return where an error was raised, "mine.py, line 3"; empty if no Python code of the user's did it.

    Parameters
    ----------
    error
        As caught.
    file
        Of the user's module: the innermost line in it counts. None, or a file that the error never passed:
        the innermost line outside of this package's `plugins`.
    """
    lines = list(_lines(error.__traceback__))
    chosen = [line for line in lines if line[0] == file] or lines
    return f"{shown_path(chosen[-1][0])}, line {chosen[-1][1]}" if chosen else ""


def place_of_code(made: object) -> str:
    """Return where a class or function was written, "mine.py, line 3"; empty if that is not known."""
    code = getattr(inspect.unwrap(made), "__code__", None) if callable(made) else None
    if code is not None:
        return f"{shown_path(code.co_filename)}, line {code.co_firstlineno}"
    try:
        file = inspect.getsourcefile(made)  # type: ignore[arg-type]
        _, line = inspect.getsourcelines(made)  # type: ignore[arg-type]
    except (OSError, TypeError):
        return ""
    return f"{shown_path(file or '')}, line {line}"


def file_of(made: object) -> str | None:
    """Return the file of the module that a class or function is from."""
    module = sys.modules.get(getattr(made, "__module__", None) or "")
    return getattr(module, "__file__", None)


def shown_value(value: object) -> str:
    """Return a value as Python writes it, shortened; its type where it cannot be written."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # noqa: BLE001 - a __repr__ of the user's own, or an int of more than 4300 digits
        return f"a value of type {type(value).__name__}"
    return text if len(text) <= _SHOWN_VALUE_CHARS_MAX else f"{text[:_SHOWN_VALUE_CHARS_MAX]} ..."


def shown_path(path: str) -> str:
    """Return a path from the current folder where it lies in there."""
    try:
        return str(Path(path).relative_to(Path.cwd()))
    except (OSError, ValueError):
        return path


def shown_folder(folder: Path) -> str:
    """Return a folder as the user would write it."""
    shown = shown_path(str(folder))
    return "the current folder" if shown == "." else shown


def _lines(trace: TracebackType | None) -> list[tuple[str, int]]:
    """Return file and line of every frame, outermost first, without ours and the import system's."""
    found = []
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if not file.startswith(("<frozen importlib", _PACKAGE_FOLDER)):
            found.append((file, trace.tb_lineno))
        trace = trace.tb_next
    return found


def at(where: str) -> str:
    """Return a place in brackets behind a space; nothing for no place."""
    return f" ({where})" if where else ""
