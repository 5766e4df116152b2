"""The carriers of frames on a serial line, and which of them bytes are of."""

from __future__ import annotations

from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import CorruptFrameError, unpack
from dcmp_hil.wire.messages import SampleReport

ENCODERS = {"cobs": cobs.encode, "slcan": slcan.encode}
"""Frames to bytes, by the name of the carrier."""
DECODERS: dict[str, type[cobs.CobsDecoder | slcan.SlcanDecoder]] = {
    "cobs": cobs.CobsDecoder,
    "slcan": slcan.SlcanDecoder,
}
"""Bytes to frames, by the name of the carrier."""
_SAMPLES_MIN = 2  # SAMPLEs: one may be an accident


def has_samples(data: bytes, decoder: cobs.CobsDecoder | slcan.SlcanDecoder) -> bool:
    """Whether SAMPLEs are among these bytes, by the decoder of a carrier."""
    found = 0
    for frame in decoder.feed(data):
        try:
            found += isinstance(unpack(frame, frame[0] & 0xF), SampleReport)
        except CorruptFrameError:
            continue
    return found >= _SAMPLES_MIN
