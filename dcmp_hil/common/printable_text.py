"""Text of a command line, of a file or of a device, as it may be written and shown."""

from __future__ import annotations

_VISIBLE_CHARACTERS = {
    **{code: 0x2400 + code for code in range(0x20) if code not in {0x09, 0x0A}},  # as control pictures
    0x7F: 0x2421,
    **dict.fromkeys(range(0x80, 0xA0), 0xFFFD),
    **dict.fromkeys(
        (0x061C, 0x200E, 0x200F, 0x2028, 0x2029), 0xFFFD
    ),  # they turn the direction, or end a line
    **dict.fromkeys((*range(0x202A, 0x202F), *range(0x2066, 0x206A)), 0xFFFD),
}


def readable(text: str) -> str:
    """Return text without surrogates, which can be encoded in UTF-8.

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


def printable(text: str) -> str:
    """Return text that does nothing to a terminal: control characters are shown, and not carried out.

    Parameters
    ----------
    text
        From anywhere; tabs and ends of lines stay.
    """
    return readable(text.translate(_VISIBLE_CHARACTERS))
