"""The record that a board keeps of itself in flash memory, as firmware/app/record.h lays it out."""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import TYPE_CHECKING

from fastcrc import crc16

if TYPE_CHECKING:
    from collections.abc import Mapping

RECORD_ADDRESS = 0x0800_4000  # sector 1, and sector 2 behind it
SECTOR_BYTES, SECTOR_COUNT = 16 * 1024, 2
MAGIC = int.from_bytes(b"DCMP", "little")
_CHECKED, _WORD = Struct("<2I8i3I2i16x"), Struct("<I")
RECORD_BYTES = _CHECKED.size + _WORD.size
_CONFIG = (
    "counts_per_rev", "period_us", "voltage_limit_mV", "slew_mV_per_ms", "watchdog_ms",
    "speed_limit_counts_s", "travel_limit_counts", "node",
)  # fmt: skip


class RecordLink(IntEnum):
    """Kinds of link between a board and its host."""

    cobs, slcan, can = range(3)


def record(
    config: Mapping[str, int],
    *,
    link: RecordLink = RecordLink.cobs,
    baud: int = 1_000_000,
    zero_code: int = 2048,
    full_scale_mV: int = 10_000,
    boot_count: int = 0,
    sequence: int = 1,
) -> bytes:
    """Return the bytes of one record.

    Parameters
    ----------
    config
        Fields of `struct dcmp_config`, as `sim_backend.board.config` gives them.
    baud
        Bit/s, of a serial link.
    zero_code
        The DAC's code that is 0 V.
    full_scale_mV
        mV, at 2048 codes from there; of a PWM board: the motor's supply.
    boot_count
        The highest number that a boot may have had so far.
    sequence
        The highest whole one counts.
    """
    *numbers, node = (config[name] for name in _CONFIG)
    checked = _CHECKED.pack(
        MAGIC, sequence, boot_count, *numbers, node, link, baud, zero_code, full_scale_mV
    )  # fmt: skip
    return checked + _WORD.pack(crc16.ibm_3740(checked))


def image(first: bytes) -> bytes:
    """Return both sectors with this record and nothing else: what is flashed at RECORD_ADDRESS."""
    return first.ljust(SECTOR_COUNT * SECTOR_BYTES, b"\xff")
