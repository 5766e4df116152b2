"""End of a run: a number in memory that its processes share, and that outlives the loop's process."""

from __future__ import annotations

import os
import struct
from typing import Literal, NamedTuple

from dcmp_hil.errors import BackendError, ConfigError, DeadlineError, OpenError, TripError
from dcmp_hil.values import EndData

LIVES, AT_ZERO, UNCONFIRMED, FORCED, NOT_ARMED = range(5)
"""Not yet; 0 V confirmed; 0 V not confirmed; signals were sent, as it did not answer STOP; this run has not
armed the device, so that it does not know the voltage: another host may have."""
RUN_CODES = (AT_ZERO, UNCONFIRMED, NOT_ARMED)
"""Codes that only the run itself writes."""
RUN_END_WORD = 11
"""Place of the number in the memory, in words of 8 bytes."""
_NUMBER = struct.Struct("q")
_WORDS_CHARS_MAX = 1000  # characters


def end_in(file: int) -> int:
    """Return the number in the memory of descriptor `file`; `LIVES` where there is none yet."""
    data = os.pread(file, _NUMBER.size, RUN_END_WORD * _NUMBER.size)
    return int(_NUMBER.unpack(data)[0]) if len(data) == _NUMBER.size else LIVES


class RunEnd(NamedTuple):
    """Knowledge of the amplifier at the end of a run: a code, and the level, words and data of an event."""

    code: int
    level: Literal["INFO", "ERROR"]
    words: str
    forced: EndData | None = None
    """What ended the run; None where it ended as it was asked to."""

    @property
    def sentence(self) -> str:
        """Return the words as a sentence of their own."""
        return f"{self.words[0].upper()}{self.words[1:]}."


ZERO = RunEnd(AT_ZERO, "INFO", "amplifier at 0 V")
"""The device was left in order."""
NOT_OURS = RunEnd(NOT_ARMED, "INFO", "the device was not armed")
"""The run ended before it had armed the device."""
_UNKNOWN = RunEnd(UNCONFIRMED, "ERROR", "0 V was not confirmed: the device goes there by itself")


def end_after(error: BaseException, *, reached: bool, armed: bool) -> RunEnd:
    """Return the knowledge of the amplifier after an error, and what the error was.

    Parameters
    ----------
    error
        What ended the run.
    reached
        Whether the run had begun to open the device.
    armed
        Whether it had armed it.
    """
    end = ZERO
    if not reached or (not armed and isinstance(error, OpenError | ConfigError)):
        end = NOT_OURS
    elif not armed or isinstance(error, BackendError) or getattr(error, "__notes__", None):
        end = _UNKNOWN
    return end._replace(forced=_forced_by(error))


def _forced_by(error: BaseException) -> EndData | None:
    """Return the cause of an end by force; None where a person asked for it (Ctrl-C)."""
    if isinstance(error, KeyboardInterrupt):
        return None
    if isinstance(error, TripError):
        cause = error.reason
    else:
        cause = "deadline" if isinstance(error, DeadlineError) else type(error).__name__
    words = (str(error) or cause)[:_WORDS_CHARS_MAX].encode("utf-8", "replace")  # paths may have surrogates
    return EndData(cause, words.decode())
