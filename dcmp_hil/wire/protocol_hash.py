"""Written by tools/protocol.py: what host and device compare before anything else."""

PROTOCOL_HASH = 0x074280F0
