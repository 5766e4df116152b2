"""End of a run: a number in memory that its processes share, and that outlives the loop's process."""

from __future__ import annotations

import os
import struct

LIVES, AT_ZERO, UNCONFIRMED, FORCED = range(4)
"""Not yet; 0 V confirmed; 0 V not confirmed; signals were sent, as it did not answer STOP."""
SAID = (AT_ZERO, UNCONFIRMED)
"""What only the run itself says."""
WORD = 11
"""Place of the number in the memory, in words of 8 bytes."""
_NUMBER = struct.Struct("q")


def end_in(file: int) -> int:
    """Return the number in the memory of descriptor `file`; `LIVES` where there is none yet."""
    data = os.pread(file, _NUMBER.size, WORD * _NUMBER.size)
    return int(_NUMBER.unpack(data)[0]) if len(data) == _NUMBER.size else LIVES
