"""Reading of single MCAP records, with checks of checksum, lengths and bounds.

https://mcap.dev/spec. The library's reader checks no attachment and stops at the first fault: decision 16.
"""

from __future__ import annotations

import struct
import zlib
from enum import IntEnum
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

import zstandard

if TYPE_CHECKING:
    from collections.abc import Callable

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
"""Opcode and length, in front of every record."""
CHUNK_BYTES_MAX = 16 << 20
"""Bytes of a block, unpacked; this program writes some kB, `mcap recover` writes 4 MiB."""
_TEXT_BYTES_MAX = 1 << 20  # bytes of an attachment or a metadata record
_RECORD_BYTES_MAX = 64 << 20  # bytes of any other record
_ZSTD_WINDOW_BYTES_MAX = 1 << 23  # bytes that zstd may look back: what level 19 asks for
_CHUNK = struct.Struct("<QQQII")
_ATTACHMENT = struct.Struct("<QQI")
_FOOTER = struct.Struct("<QQI")
_STATISTICS = struct.Struct("<QHIIIIQQI")
_COUNT = struct.Struct("<HQ")
_U32, _U64 = struct.Struct("<I"), struct.Struct("<Q")


class Op(IntEnum):
    """MCAP opcodes that the reader evaluates."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    STATISTICS = 0x0B
    ATTACHMENT = 0x09
    METADATA = 0x0C
    DATA_END = 0x0F


KNOWN_OPCODES = range(Op.HEADER, Op.DATA_END + 1)


class RecordError(Exception):
    """A record is not what it says; its text says why, as the end of a sentence."""


class Attachment(NamedTuple):
    """A file in the file, under a checksum that its times are under as well."""

    log_time: int
    name: str
    data: bytes


def length_allowed(opcode: int, length: int) -> bool:
    """Return whether a record of this kind may be so long (bytes)."""
    if opcode in {Op.ATTACHMENT, Op.METADATA, Op.SCHEMA, Op.CHANNEL, Op.HEADER}:
        return length <= _TEXT_BYTES_MAX
    return length <= _RECORD_BYTES_MAX


def size_of_chunk(content: bytes) -> int:
    """Return the bytes that a block says it unpacks to.

    Raises
    ------
    RecordError
        If it is too short to say it, or says too much.
    """
    if len(content) < _CHUNK.size:
        raise RecordError("it is too short")
    size: int = _CHUNK.unpack_from(content)[2]
    if size > CHUNK_BYTES_MAX:
        raise RecordError(f"it would unpack to {size / 2**20:.4g} MiB")
    return size


def unpacked(content: bytes) -> bytes:
    """Return the records in a block.

    Raises
    ------
    RecordError
        If its checksum is wrong, or there is none.
    """
    size = size_of_chunk(content)
    _, _, _, crc, name_length = _CHUNK.unpack_from(content)
    start = _CHUNK.size + name_length
    name = content[_CHUNK.size : start]
    if name not in _UNPACK or len(content) < start + _U64.size:
        raise RecordError("it is damaged")
    (length,) = _U64.unpack_from(content, start)
    packed = content[start + _U64.size :]
    if len(packed) != length:
        raise RecordError("its lengths contradict each other")
    try:
        data = _UNPACK[name](packed, size)
    except (RuntimeError, ValueError, MemoryError, zstandard.ZstdError):
        raise RecordError("it is damaged") from None
    if len(data) != size or zlib.crc32(data) != crc:
        raise RecordError("its checksum is wrong")
    return data


def attachment_in(content: bytes) -> Attachment:
    """Return an attachment.

    Raises
    ------
    RecordError
        If its checksum is wrong, or its lengths are.
    """
    try:
        log_time, _, name_length = _ATTACHMENT.unpack_from(content)
        name_end = _ATTACHMENT.size + name_length
        (type_length,) = _U32.unpack_from(content, name_end)
        start = name_end + _U32.size + type_length
        (length,) = _U64.unpack_from(content, start)
        start += _U64.size
        (crc,) = _U32.unpack_from(content, len(content) - _U32.size)
    except struct.error:
        raise RecordError("its lengths contradict each other") from None
    data = content[start : len(content) - _U32.size]
    if len(data) != length:
        raise RecordError("its lengths contradict each other")
    if zlib.crc32(content[: -_U32.size]) != crc:
        raise RecordError("its checksum is wrong")
    return Attachment(log_time, content[_ATTACHMENT.size : name_end].decode("utf-8", "replace"), data)


def metadata_in(content: bytes) -> tuple[str, dict[str, str]]:
    """Return the name and the entries of a metadata record; it has no checksum.

    Raises
    ------
    RecordError
        If its lengths contradict each other.
    """
    name, at = _text(content, 0)
    if len(content) < at + _U32.size:
        raise RecordError("it is too short")
    end = at + _U32.size + _U32.unpack_from(content, at)[0]
    at += _U32.size
    if end != len(content):
        raise RecordError("its lengths contradict each other")
    entries = {}
    while at < end:
        key, at = _text(content, at)
        entries[key], at = _text(content, at)
    return name, entries


def counts_in(content: bytes) -> dict[int, int]:
    """Return how many messages each channel has, as the statistics of a file say.

    Raises
    ------
    RecordError
        If its lengths contradict each other.
    """
    if len(content) < _STATISTICS.size:
        raise RecordError("it is too short")
    length = _STATISTICS.unpack_from(content)[-1]
    pairs = content[_STATISTICS.size :]
    if len(pairs) != length or length % _COUNT.size:
        raise RecordError("its lengths contradict each other")
    return dict(_COUNT.iter_unpack(pairs))


def channel_in(content: bytes) -> tuple[int, int, str, str]:
    """Return number, schema, topic and encoding of a channel.

    Raises
    ------
    RecordError
        If its lengths contradict each other.
    """
    if len(content) < _U32.size:
        raise RecordError("it is too short")
    number, schema = struct.unpack_from("<HH", content)
    topic, at = _text(content, _U32.size)
    encoding, _ = _text(content, at)
    return number, schema, topic, encoding


def schema_in(content: bytes) -> tuple[int, bytes]:
    """Return number and text of a schema.

    Raises
    ------
    RecordError
        If its lengths contradict each other.
    """
    if len(content) < 2:  # noqa: PLR2004 - its number
        raise RecordError("it is too short")
    (number,) = struct.unpack_from("<H", content)
    _, at = _text(content, 2)
    _, at = _text(content, at)
    return number, content[at + _U32.size :]


def footer_in(content: bytes) -> int:
    """Return the checksum of the summary; 0 is none.

    Raises
    ------
    RecordError
        If it has another length.
    """
    if len(content) != _FOOTER.size:
        raise RecordError("its length is wrong")
    crc: int = _FOOTER.unpack(content)[2]
    return crc


def data_end_in(content: bytes) -> int:
    """Return the checksum of everything in front of this record; 0 is none.

    Raises
    ------
    RecordError
        If it has another length.
    """
    if len(content) != _U32.size:
        raise RecordError("its length is wrong")
    crc: int = _U32.unpack(content)[0]
    return crc


def _text(content: bytes, at: int) -> tuple[str, int]:
    """Return the text that stands at `at`, and where it ends."""
    if len(content) < at + _U32.size:
        raise RecordError("it is too short")
    (length,) = _U32.unpack_from(content, at)
    end = at + _U32.size + length
    if end > len(content):
        raise RecordError("its lengths contradict each other")
    return content[at + _U32.size : end].decode("utf-8", "replace"), end


def _unpack_zstd(packed: bytes, size: int) -> bytes:
    """Unpack one frame, to `size` bytes at most, for any size that the frame itself states."""
    said = zstandard.get_frame_parameters(packed)
    if said.window_size > _ZSTD_WINDOW_BYTES_MAX:
        raise ValueError("it asks for too much memory")
    if said.content_size not in {size, zstandard.CONTENTSIZE_UNKNOWN}:
        raise ValueError("it says two sizes")
    return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)


def _unpack_lz4(packed: bytes, size: int) -> bytes:
    frame: Any = import_module("lz4.frame")  # it has no types
    data: bytes = frame.LZ4FrameDecompressor().decompress(packed, max_length=size)
    return data


_UNPACK: dict[bytes, Callable[[bytes, int], bytes]] = {
    b"zstd": _unpack_zstd,
    b"lz4": _unpack_lz4,
    b"": lambda packed, _: packed,
}
