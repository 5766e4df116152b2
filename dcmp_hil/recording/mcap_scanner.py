"""The records of an MCAP file in order, each checked; behind what is damaged it goes on at the next one.

A record that is found again after damage must be a block or an attachment whose checksum is right, or the end
of the data. What all of it costs has a bound that follows from the size of the file.
"""

from __future__ import annotations

import re
import struct
import zlib
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.recording.mcap_records import (
    HEAD,
    KNOWN_OPCODES,
    MAGIC,
    Attachment,
    Op,
    RecordError,
    attachment_in,
    data_end_in,
    footer_in,
    length_allowed,
    size_of_chunk,
    unpacked,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import IO

_UNPACKED_BYTES_MAX = 64 << 20  # of all blocks of a small file
_UNPACKED_BYTES_PER_BYTE = 16  # more of them for each byte of the file
_WINDOW_BYTES, _OVERLAP_BYTES = 1 << 20, 64  # bytes that are searched at a time
_SEARCH_RATIO_MAX = 8  # times the size of the file that is looked at, or unpacked, in search of records
# How a record that is found again looks, and how far behind its beginning.
_LANDMARKS = re.compile(
    rb"(?s:(?P<chunk>(?:\x04\0\0\0zstd|\x03\0\0\0lz4))"
    rb"|(?P<attachment>\x08\0\0\0(?:rig|run|end)\.json)"
    rb"|(?P<end>\x0f\x04\0{7}|\x02\x14\0{7}))"
)
_LENGTH = struct.Struct("<Q")
_LENGTH_OFFSETS = {"chunk": 37, "attachment": 25, "end": 0}


class Record(NamedTuple):
    """A record that is as it was written, as far as it can be known.

    Parameters
    ----------
    opcode
        What it is.
    end
        Where the next one begins, bytes.
    content
        What is in it; of a block, the records in it, unpacked.
    """

    opcode: int
    end: int
    content: bytes


class Damage(NamedTuple):
    """A stretch of the file that is left out.

    Parameters
    ----------
    at, end
        Where, bytes.
    why
        What was found there, as the end of a sentence.
    """

    at: int
    end: int
    why: str


class Scanner:
    """Reads a file once, from its beginning to its end.

    Parameters
    ----------
    file
        The file.
    size
        Its bytes.

    Attributes
    ----------
    data_checked
        Whether the checksum of the whole data section is right; None where there is none, or it was not
        reached in one piece.
    summary_checked
        The same for the index at the end.
    closed
        Whether the file ends as it should.
    """

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._size = file, size
        self._room = _UNPACKED_BYTES_MAX + _UNPACKED_BYTES_PER_BYTE * size
        self._searched = 0
        self._crc = 0
        self._in_one_piece = True
        self.data_checked: bool | None = None
        self.summary_checked: bool | None = None
        self.closed = False

    def __iter__(self) -> Iterator[Record | Damage]:
        """Yield the records of the file, and the damage between them."""
        at = len(MAGIC)
        if self._bytes(0, at) != MAGIC:
            at = self._resume(0)
            yield Damage(0, at, "its first bytes are damaged")
        else:
            self._crc = zlib.crc32(MAGIC)
        while at < self._size:
            try:
                record = self._record(at, follow=True)
            except RecordError as error:
                end = self._resume(at + 1)
                self._in_one_piece = False
                yield Damage(at, end, str(error))
                at = end
                continue
            yield record
            at = record.end
            if record.opcode == Op.FOOTER:
                at += len(MAGIC)
                self.closed = self._bytes(record.end, len(MAGIC)) == MAGIC and at == self._size
                if not self.closed:
                    why = "the file was cut off" if at > self._size else "it goes on behind its end"
                    at = self._resume(record.end)
                    yield Damage(record.end, at, why)

    def _record(self, at: int, *, follow: bool = False) -> Record:
        """Return the record at `at`, checked.

        Parameters
        ----------
        at
            Where, bytes.
        follow
            Whether this is the way through the file, whose checksums are made up, and no search.
        """
        head = self._bytes(at, HEAD.size)
        if len(head) < HEAD.size:
            raise RecordError("the file was cut off")
        opcode, length = HEAD.unpack(head)
        if opcode not in KNOWN_OPCODES:
            raise RecordError("there is no record")
        if not length_allowed(opcode, length):
            raise RecordError("a record says that it is longer than any is")
        if length > self._size - at - HEAD.size:
            raise RecordError("the file was cut off")
        content = self._bytes(at + HEAD.size, length)
        if len(content) != length:
            raise RecordError("the file was cut off")
        record = Record(opcode, at + HEAD.size + length, self._checked(opcode, content))
        if follow:
            self._sum_up(opcode, head, content)
        return record

    def _checked(self, opcode: int, content: bytes) -> bytes:
        if opcode == Op.CHUNK:
            self._room -= size_of_chunk(content)
            if self._room < 0:
                raise RecordError("its blocks would unpack to far more than a recording of this size holds")
            return unpacked(content)
        if opcode == Op.ATTACHMENT:
            attachment_in(content)
        elif opcode == Op.DATA_END:
            data_end_in(content)
        elif opcode == Op.FOOTER:
            footer_in(content)
        return content

    def _sum_up(self, opcode: int, head: bytes, content: bytes) -> None:
        """Update the checksum of the section, and compare it at the section's end."""
        if opcode == Op.DATA_END:
            said = data_end_in(content)
            self.data_checked = said == self._crc if said and self._in_one_piece else None
            self._crc, self._in_one_piece = 0, True
        elif opcode == Op.FOOTER:
            said = footer_in(content)
            made = zlib.crc32(head + content[:-4], self._crc)
            self.summary_checked = said == made if said and self._in_one_piece else None
        else:
            self._crc = zlib.crc32(content, zlib.crc32(head, self._crc))

    def _resume(self, at: int) -> int:
        """Return where the first record from `at` on begins that can be trusted; the file's end if none."""
        first = at
        while at < self._size:
            window = self._bytes(at, _WINDOW_BYTES)
            for found in _LANDMARKS.finditer(window):
                start = at + found.start() - _LENGTH_OFFSETS[found.lastgroup or "end"]
                if start >= first and self._trusted(start):
                    return start
                if self._searched > _SEARCH_RATIO_MAX * self._size + _UNPACKED_BYTES_MAX:
                    return self._size
            at += max(1, len(window) - _OVERLAP_BYTES) if len(window) == _WINDOW_BYTES else _WINDOW_BYTES
        return self._size

    def _trusted(self, start: int) -> bool:
        """Return whether a valid record begins at `start`; count the cost of the search."""
        room = self._room
        try:
            self._searched += self._record(start).end - start
        except RecordError:
            (length,) = _LENGTH.unpack(self._bytes(start + 1, _LENGTH.size).ljust(_LENGTH.size, b"\0"))
            self._searched += min(length, self._size)
            return False
        finally:
            self._searched += room - self._room
            self._room = room
        return True

    def _bytes(self, at: int, count: int) -> bytes:
        self._file.seek(at)
        return self._file.read(count)


def attachment_of(record: Record) -> Attachment:
    """Return what a record that was found to be an attachment holds."""
    return attachment_in(record.content)
