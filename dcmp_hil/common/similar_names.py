"""Names that resemble an unknown one: the one "did you mean" of all messages."""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

_SIMILARITY_MIN = 0.6  # of difflib; 1 is equality


def closest(got: str, known: Iterable[str], *, cutoff: float = _SIMILARITY_MIN) -> str | None:
    """Return the known name that resembles `got` most; None if none resembles it.

    Parameters
    ----------
    got
        The unknown name.
    known
        The names that there are.
    cutoff
        From 0 to 1: how similar a name must be, as `difflib.get_close_matches` measures it.
    """
    close = get_close_matches(got, list(known), n=1, cutoff=cutoff)
    return close[0] if close else None


def quoted(name: str) -> str:
    """Return a name in quotation marks."""
    return f'"{name}"'


def did_you_mean(
    got: str,
    known: Iterable[str],
    otherwise: str = "",
    *,
    shown: Callable[[str], str] = quoted,
    cutoff: float = _SIMILARITY_MIN,
) -> str:
    """Return the question for the known name that resembles `got` most.

    Parameters
    ----------
    got, known, cutoff
        See `closest`.
    otherwise
        Returned if no name resembles it.
    shown
        Writes the name; `str` leaves it without quotation marks.
    """
    close = closest(got, known, cutoff=cutoff)
    return otherwise if close is None else f"Did you mean {shown(close)}?"
