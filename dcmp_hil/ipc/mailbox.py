"""The mailbox between command process and loop: one slot in shared memory, without a lock."""

from __future__ import annotations

import pickle
import struct
import zlib
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.common.printable_text import readable
from dcmp_hil.errors import ConfigError
from dcmp_hil.ipc.run_end import FORCED, RUN_CODES, RUN_END_WORD, UNCONFIRMED

if TYPE_CHECKING:
    import mmap

    from dcmp_hil.control.change import Change

_HEADER_WORDS = 16  # of 8 bytes
(
    _ASKED,
    _TAKEN_NUMBER,
    _ANSWER_CODE,
    _PHASE,
    _LENGTH,
    _CHECK,
    _END_TEXT_LENGTH,
    _BELL,
    _STOP,
    _STOP_TAKEN,
    _HANDLERS,
    _END,
) = range(12)
_TIME = struct.Struct("d")
_TIME_OFFSET_BYTES, _END_TEXT_OFFSET_BYTES, _SLOT_OFFSET_BYTES = 8 * _HEADER_WORDS, 256, 4096
BELL_WORD = _BELL
"""Place of the number that tells the loop to look at the others."""
MAILBOX_BYTES = 1 << 16
"""Bytes of a mailbox."""

APPLIED, LOWERING, FAILED = 1, 2, 3
"""Answers."""

STOP_REQUEST = 256
"""Asks for the end where no signal did, whose numbers are smaller."""


class Answer(NamedTuple):
    """Result of a change, and the device time at which it was applied or failed."""

    what: int  # APPLIED, LOWERING or FAILED
    t: float  # s, device time


class Mailbox:
    """One slot for a change, one for its answer, and a few words about the run.

    The loop reads one number a period, the bell. What is asked for is written before the bell rings, an
    answer before its number.

    Parameters
    ----------
    memory
        Of `MAILBOX_BYTES` bytes, zeros at first; None allocates memory that is not shared.

    Attributes
    ----------
    words
        The numbers; `words[BELL]` is what the loop looks at.
    """

    def __init__(self, memory: mmap.mmap | bytearray | None = None) -> None:
        self.memory = bytearray(MAILBOX_BYTES) if memory is None else memory
        self.words = memoryview(self.memory)[: 8 * _HEADER_WORDS].cast("q")

    # ---------------------------------------------------------------- the side that asks

    def put(self, change: Change) -> int:
        """Put a change into the slot, over any earlier one; return its number.

        Raises
        ------
        ConfigError
            If it is too long for the slot.
        """
        data = pickle.dumps(change)
        if len(data) > MAILBOX_BYTES - _SLOT_OFFSET_BYTES:
            raise ConfigError("The change is too long for its way to the loop. Change fewer keys at once.")
        self.memory[_SLOT_OFFSET_BYTES : _SLOT_OFFSET_BYTES + len(data)] = data
        self.words[_LENGTH], self.words[_CHECK] = len(data), zlib.crc32(data)
        self.words[_ASKED] += 1
        self.ring_bell()
        return self.words[_ASKED]

    def ask_stop(self, by: int = STOP_REQUEST) -> None:
        """Ask the loop for the end of the run, by a signal or by `STOP_REQUEST`; the first one counts."""
        self.words[_STOP] = self.words[_STOP] or by
        self.ring_bell()

    def ask_handlers(self) -> None:
        """Ask the loop to put its signal handlers in again, where something else is there."""
        self.words[_HANDLERS] += 1
        self.ring_bell()

    def ring_bell(self) -> None:
        """Make the loop read the rest of the mailbox."""
        self.words[BELL_WORD] += 1

    @property
    def stop_taken(self) -> bool:
        """Whether the loop knows that it is to end the run."""
        return bool(self.words[_STOP_TAKEN])

    @property
    def end(self) -> int:
        """Code of the run's end, such as `AT_ZERO`; `LIVES` during the run."""
        return self.words[RUN_END_WORD]

    def tell_taken(self) -> None:
        """Note that the run has received the request to end."""
        self.words[_STOP_TAKEN] = 1

    @property
    def ended(self) -> bool:
        """Whether the run has ended by itself and said how."""
        return self.words[RUN_END_WORD] in RUN_CODES

    def tell_forced(self) -> None:
        """Note that signals are sent; a run that still ends in order notes that later."""
        if not self.ended:
            self.words[RUN_END_WORD] = FORCED

    def answer(self, number: int) -> Answer | None:
        """Return what became of the change of that number; None as long as the loop has not taken it."""
        if self.words[_TAKEN_NUMBER] != number:
            return None
        return Answer(self.words[_ANSWER_CODE], float(_TIME.unpack_from(self.memory, _TIME_OFFSET_BYTES)[0]))

    def withdraw(self) -> None:
        """Remove a change that the loop has not taken yet."""
        self.words[_LENGTH] = 0

    @property
    def phase(self) -> int:
        """Phase of the run, as an index in the list of phases."""
        return self.words[_PHASE]

    @property
    def last_words(self) -> str:
        """Sentence on the run's end; empty during the run."""
        return bytes(
            self.memory[_END_TEXT_OFFSET_BYTES : _END_TEXT_OFFSET_BYTES + self.words[_END_TEXT_LENGTH]]
        ).decode("utf-8", "replace")

    # ---------------------------------------------------------------- the loop's side

    def take(self) -> Change | None:
        """Return the change in the slot; None if it was withdrawn."""
        data = self.memory[_SLOT_OFFSET_BYTES : _SLOT_OFFSET_BYTES + self.words[_LENGTH]]
        if not data or zlib.crc32(data) != self.words[_CHECK]:
            return None
        change: Change = pickle.loads(data)  # noqa: S301 - written by our own child
        return change

    def reply(self, number: int, answer: Answer) -> None:
        """Store the answer to the change with this number."""
        self.words[_ANSWER_CODE] = answer.what
        _TIME.pack_into(self.memory, _TIME_OFFSET_BYTES, answer.t)
        self.words[_TAKEN_NUMBER] = number

    @property
    def asked(self) -> int:
        """Number of the newest change."""
        return self.words[_ASKED]

    def take_stop(self) -> int:
        """Return the signal that asks for the end, `STOP_REQUEST`, or 0 if nothing does; mark it as taken."""
        if self.words[_STOP]:
            self.tell_taken()
        return self.words[_STOP]

    @property
    def handlers_asked(self) -> int:
        """Number of requests to restore the signal handlers."""
        return self.words[_HANDLERS]

    def tell_phase(self, phase: int) -> None:
        """Write the phase of the run."""
        self.words[_PHASE] = phase

    def tell_end(self, sentence: str, end: int = UNCONFIRMED) -> None:
        """Write how the run ended: in words, and as a code such as `AT_ZERO`."""
        data = readable(sentence).encode()[: _SLOT_OFFSET_BYTES - _END_TEXT_OFFSET_BYTES]
        self.memory[_END_TEXT_OFFSET_BYTES : _END_TEXT_OFFSET_BYTES + len(data)] = data
        self.words[_END_TEXT_LENGTH] = len(data)
        self.words[RUN_END_WORD] = end
