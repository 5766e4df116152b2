"""What every carrier carries."""

from typing import NamedTuple


class Frame(NamedTuple):
    """A classic CAN frame, whatever carries it."""

    id: int  # 11 bits: message number * 16 + node
    data: bytes  # 0 to 8 bytes
