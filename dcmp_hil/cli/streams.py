"""Standard output and standard error that never fail: one that takes nothing more is given up, quietly."""

from __future__ import annotations

import codecs
import io
import os
import select
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import TextIO

    from _typeshed import ReadableBuffer

_STDIN_FILENO, _STDOUT_FILENO, _STDERR_FILENO = 0, 1, 2
_ERROR_HANDLER = "dcmp_hil.substitute"
_SUBSTITUTES = str.maketrans(
    "µ²\N{EN DASH}→≤≥\N{MULTIPLICATION SIGN}…─│╭╮╰╯┌┐└┘├┤━┃▁▂▃▄▅▆▇█",
    "u2-><>x.-|++++++++++-|._-=+*%#",
)


class _Descriptor(io.FileIO):
    """A file descriptor that is led to the null device once it fails.

    Parameters
    ----------
    number
        Of the descriptor; it is never closed.
    replaced
        The stream that wrote there before. It is kept: collected, it would close the descriptor.

    Attributes
    ----------
    failed
        Whether it was led there.
    """

    def __init__(self, number: int, replaced: TextIO | None = None) -> None:
        super().__init__(number, "wb", closefd=False)
        self.failed = False
        self.replaced = replaced

    def write(self, data: ReadableBuffer, /) -> int:
        """Write, or drop, all of `data`; a pipe that is full is waited for, even one that does not block."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while len(rest):
                written: int | None = super().write(rest)
                if written is None:
                    _wait_for_room(self.fileno())
                else:
                    rest = rest[written:]
        except OSError:  # its reader is gone, its disk full, its terminal closed
            self.failed = True
            _lead_to_null(self.fileno())
        return size


def guard() -> None:
    """Keep errors of the readers from `sys.stdout` and `sys.stderr`; a second call changes nothing.

    Characters that an encoding lacks are replaced by similar ones, or by a question mark. Descriptors that
    the caller closed lead to the null device: the next file that is opened would else take their place.
    """
    codecs.register_error(_ERROR_HANDLER, _substitute)
    for number in (_STDIN_FILENO, _STDOUT_FILENO, _STDERR_FILENO):
        try:
            os.fstat(number)
        except OSError:
            _lead_to_null(number)
    sys.stdout = _guarded(sys.stdout, _STDOUT_FILENO)
    sys.stderr = _guarded(sys.stderr, _STDERR_FILENO)


def text_on(number: int) -> TextIO:
    """Return a stream like those of `guard` on a descriptor, which it never closes."""
    return _text(number, getattr(sys.stderr, "encoding", None) or "utf-8", line_buffering=True)


def output_failed() -> bool:
    """Return whether standard output was given up: a command that only prints can end then."""
    raw = _raw(sys.stdout)
    return isinstance(raw, _Descriptor) and raw.failed


def _guarded(stream: TextIO | None, number: int) -> TextIO:
    if stream is None:  # the caller closed it
        return _text(number, "utf-8", line_buffering=True)
    try:
        own = stream.fileno() == number and not isinstance(_raw(stream), _Descriptor)
    except (OSError, ValueError):
        own = False  # a program that calls us put it there
    if not own:
        return stream
    return _text(number, stream.encoding, line_buffering=bool(stream.line_buffering), replaced=stream)


def _text(number: int, encoding: str, *, line_buffering: bool, replaced: TextIO | None = None) -> TextIO:
    binary = io.BufferedWriter(_Descriptor(number, replaced))
    return io.TextIOWrapper(binary, encoding=encoding, errors=_ERROR_HANDLER, line_buffering=line_buffering)


def _raw(stream: TextIO) -> object:
    return getattr(getattr(stream, "buffer", None), "raw", None)


def _substitute(error: UnicodeError) -> tuple[str, int]:
    """Replace what cannot be encoded character by character, so that tables stay aligned."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = error.object[error.start : error.end].translate(_SUBSTITUTES)
    return "".join(c if c.isascii() else "?" for c in text), error.end


def _wait_for_room(number: int) -> None:
    waiting = select.poll()
    waiting.register(number, select.POLLOUT)
    waiting.poll()


def _lead_to_null(number: int) -> None:
    null = os.open(os.devnull, os.O_RDWR)
    if null == number:
        os.set_inheritable(number, True)
    else:
        os.dup2(null, number)
        os.close(null)
