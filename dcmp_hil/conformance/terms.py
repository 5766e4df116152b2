"""Words that the parts of a check share: the carriers, and the error of a check that cannot judge."""

from __future__ import annotations

COBS, SLCAN, CAN = "cobs", "slcan", "can"
CARRIERS = (COBS, SLCAN, CAN)


class NotJudgedError(Exception):
    """A check cannot judge this device now: the reason."""
