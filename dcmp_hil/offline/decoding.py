"""From the bytes of a recording to its lines, in any usual encoding."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.errors import ConfigError

if TYPE_CHECKING:
    from pathlib import Path

_BOMS = (
    (b"\xef\xbb\xbf", "utf-8-sig"),
    (b"\xff\xfe\x00\x00", "utf-32"),
    (b"\x00\x00\xfe\xff", "utf-32"),
    (b"\xff\xfe", "utf-16"),
    (b"\xfe\xff", "utf-16"),
)
_ENCODING_NAMES = {
    "utf-8-sig": "UTF-8",
    "utf-16-le": "UTF-16",
    "utf-16-be": "UTF-16",
    "cp1252": "Windows-1252",
}
_OTHER_FILES = (
    (b"PK\x03\x04", "a zip or Excel workbook"),
    (b"\xd0\xcf\x11\xe0", "an Excel workbook"),
    (b"MATLAB 5.0", "a MATLAB file"),
    (b"\x89HDF", "an HDF5 or MATLAB file"),
    (b"PAR1", "a Parquet file"),
    (b"\x1f\x8b", "a gzip file"),
    (b"TDSm", "a TDMS file"),
    (b"#ROSBAG", "a ROS bag"),
    (b"\x89MCAP", "an MCAP file"),
)
_ENCODING_SAMPLE_BYTES = 4096  # bytes that the encoding is told from
_LINE_CHARS_MAX = 1_000_000  # characters
_FILE_MAX_MIB = 128  # an hour at 1 kHz in three columns; reading takes about 17 times as much memory
_UTF16_NULS_SHARE_MIN = 0.3  # share of NULs on one side of UTF-16 text
_CONTROL_CHARS_SHARE_MIN = 0.1  # share of control characters that no text has
_LINE_END = re.compile(r"\r\n|\n|\r")


class Lines(NamedTuple):
    """A text file as lines.

    Parameters
    ----------
    path
        Where they came from.
    lines
        Without their ends; NULs at either end of a line are gone.
    ended
        Whether the last line had an end, so that it is known to be whole.
    notes
        What the reader should know, one sentence each.
    """

    path: Path
    lines: list[str]
    ended: bool
    notes: list[str]


def read_lines(path: Path) -> Lines:
    """Read a text file in UTF-8, UTF-16, UTF-32 or Windows-1252, with any line ends.

    Raises
    ------
    ConfigError
        If the file is missing, too long or no text.
    """
    try:
        with path.open("rb") as file:
            raw = file.read((_FILE_MAX_MIB << 20) + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"{path}: {reason}. Check the path and its permissions.") from None
    if len(raw) > _FILE_MAX_MIB << 20:
        raise ConfigError(
            f"{path}: more than {_FILE_MAX_MIB} MiB, the most that is read as text. Check the path; divide a "
            "long recording into parts, or leave out columns that are not needed."
        )
    for magic, what in _OTHER_FILES:
        if raw.startswith(magic):
            raise ConfigError(f"{path}: this is {what}, not text. Save it as CSV.")
    text, encoding = _decode(raw)
    notes = [f"Read as {encoding} text."] if encoding not in ("UTF-8", "utf-8") else []
    head = text[:_ENCODING_SAMPLE_BYTES].replace("\0", "")
    if len(re.findall(r"[\x01-\x08\x0e-\x1f\ufffd]", head)) > _CONTROL_CHARS_SHARE_MIN * max(1, len(head)):
        raise ConfigError(f"{path}: not a text file. Save it as comma-separated text.")
    nuls = text.count("\0")
    if nuls:
        notes.append(f"The file has {nuls} NUL characters: a number that holds one is left out.")
    lines = [line.strip("\0\x1a\ufeff") for line in _LINE_END.split(text)]
    if (longest := max(map(len, lines))) > _LINE_CHARS_MAX:
        raise ConfigError(
            f"{path}: a line has {longest:,} characters, which no row of a recording has. Save it as "
            "comma-separated text, a row a sample."
        )
    return Lines(path, lines, text.rstrip("\0\x1a")[-1:] in ("\n", "\r", ""), notes)


def _decode(raw: bytes) -> tuple[str, str]:
    """Return the text, and the encoding's usual name."""
    encoding = next((name for bom, name in _BOMS if raw.startswith(bom)), None) or _wide(
        raw[:_ENCODING_SAMPLE_BYTES]
    )
    if encoding is not None:
        return raw.decode(encoding, "replace"), _ENCODING_NAMES.get(encoding, encoding.upper())
    text = raw.decode("utf-8", "replace")
    broken = text.count("\ufffd")
    if not broken:
        return text, "UTF-8"
    foreign = sum(1 for sign in text if ord(sign) > 127) - broken  # noqa: PLR2004 - the last of ASCII
    if foreign > broken:  # damaged UTF-8 is still that
        return text, "UTF-8"
    return raw.decode("cp1252", "replace"), _ENCODING_NAMES["cp1252"]


def _wide(head: bytes) -> str | None:
    """Return the kind of UTF-16 without a mark: every other byte of plain text is 0."""
    if len(head) < 4:  # noqa: PLR2004 - two characters
        return None
    for encoding, side, other in (("utf-16-le", 1, 0), ("utf-16-be", 0, 1)):
        nuls, rest = head[side::2].count(0), head[other::2].count(0)
        if nuls > _UTF16_NULS_SHARE_MIN * len(head) and rest < 0.1 * nuls:
            return encoding
    return None
