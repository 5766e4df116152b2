"""Type of a CAN frame, common to all links."""

from typing import TypeAlias

Frame: TypeAlias = tuple[int, bytes]
"""A classic CAN frame, over any link: 11 bits of identifier (message number * 16 + node), 0 to 8 bytes.

A plain tuple: a loop makes two of them a period, and one with names takes five times as long to make.
"""
