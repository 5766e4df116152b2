"""Which carrier bytes are of, where it is not the one that was expected."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.wire.codec import CorruptFrameError, unpack
from dcmp_hil.wire.messages import SampleReport

if TYPE_CHECKING:
    from dcmp_hil.wire.cobs import Receiver as Cobs
    from dcmp_hil.wire.slcan import Receiver as Slcan

_SAMPLES_MIN = 2  # SAMPLEs: one may be an accident


def has_samples(data: bytes, receiver: Cobs | Slcan) -> bool:
    """Whether SAMPLEs are among these bytes, by the receiver of a carrier."""
    found = 0
    for frame in receiver.feed(data):
        try:
            found += isinstance(unpack(frame, frame[0] & 0xF), SampleReport)
        except CorruptFrameError:
            continue
    return found >= _SAMPLES_MIN
