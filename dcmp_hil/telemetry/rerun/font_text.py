"""Text for Rerun's viewers: characters that their fonts lack are named instead.

A viewer without a window ends at such a character (``No glyph for ...``), a web viewer draws an empty box.
Names of rigs, notes, paths and keys are the user's own, so they may contain any character.
"""

from __future__ import annotations

import re
import unicodedata

_DRAWN = (
    r"\n\t\x20-\x7e\xa0-\xac\xae-\u0148\u014a-\u017f\u018f\u0192\u01a0\u01a1\u01af\u01b0\u01cd-\u01dc\u0218-\u021b"
    r"\u0259\u02b9\u02ba\u02bc\u02c6\u02c7\u02c9\u02d8-\u02dd\u0384-\u038a\u038c\u038e-\u03a1\u03a3-\u03cf"
    r"\u0401-\u040c\u040e-\u044f\u0451-\u045c\u045e\u045f\u0490\u0491\u1e80-\u1e85\u1e9e\u1ea0-\u1ef9"
    r"\u2010\u2013\u2014\u2018-\u2022\u2024\u2026\u2030\u2032-\u2034\u2039\u203a\u2070\u2074-\u207a\u2080-\u2089"
    r"\u20ac\u20bd\u2116\u2122\u2190-\u2199\u21d0\u21d2\u21d4\u2202\u2205\u2206\u220f\u2211\u2212\u221a\u221e\u222b"
    r"\u2248\u2260\u2264\u2265\u25a0\u25a1\u25b2\u25b3\u25b6\u25b7\u25bc\u25bd\u25c0\u25c1\u25c6\u25c7\u25cb\u25cf"
    r"\u26a0\u2713\u2717"
)
"""Characters of both fonts of the viewer, Inter and JetBrains Mono, as a class of a regular expression."""
_MISSING = re.compile(f"[^{_DRAWN}]+")
_LINE_END = re.compile(r"\s*[\r\n]\s*")
_MARKUP = re.compile(r"[\\`*\[\]<&|~$]|(?<!\w)_|_(?!\w)")


def drawable(text: str) -> str:
    """Return `text` with each run of characters that a viewer cannot draw named: ``{U+4E2D U+6587}``."""
    return _MISSING.sub(lambda found: f"{{{_names(found[0], ' ', 'U+')}}}", _composed(text))


def markdown(text: str) -> str:
    """Return `text` as Markdown that shows it as it is, in one line, behind the beginning of a line.

    A rig's file may be called ``a|b.csv``, which would end a cell of a table, and a sentence may have several
    lines, of which one begins as a heading does.
    """
    return _MARKUP.sub(r"\\\g<0>", _LINE_END.sub(" ", drawable(text)))


def drawable_path(path: str) -> str:
    """Return an entity's path with such characters named: ``params/_4E2D_6587_``."""
    return _MISSING.sub(lambda found: f"_{_names(found[0], '_')}_", _composed(path))


def _composed(text: str) -> str:
    """Write a letter and its accent as one character: the fonts have few accents of their own."""
    return unicodedata.normalize("NFC", text.replace("\r\n", "\n"))


def _names(characters: str, between: str, prefix: str = "") -> str:
    return between.join(f"{prefix}{ord(character):04X}" for character in characters)
