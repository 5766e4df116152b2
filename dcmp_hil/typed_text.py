"""Text of a command line, as its user typed it."""

from __future__ import annotations


def readable(text: str) -> str:
    """Return text that every UTF-8 file takes.

    In a locale that knows ASCII alone, Python keeps the other bytes of an argument as surrogates, which
    cannot be written; they are the UTF-8 of what was typed.

    Parameters
    ----------
    text
        An argument, or a message that holds one.
    """
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "replace")
    except UnicodeEncodeError:  # half a pair, as JSON may name it: no byte of a command line
        return text.encode("utf-8", "replace").decode("utf-8")
