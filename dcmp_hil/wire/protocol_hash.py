"""Written by tools/protocol.py: what host and device compare before anything else."""

PROTOCOL_HASH = 0xEB5B950B
