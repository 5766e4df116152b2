"""Checksums of the wire: crc8 ends every frame, and crc16 encloses a frame on a serial line."""

from __future__ import annotations

import binascii

import fastcrc

crc8 = fastcrc.crc8.autosar
"""CRC-8/AUTOSAR of bytes; a second argument is the checksum of the bytes before them."""
crc16 = binascii.crc_hqx
"""CRC-16/IBM-3740 of bytes; the second argument, as of crc8, is `CRC16_START` at the beginning."""
CRC16_START = 0xFFFF
