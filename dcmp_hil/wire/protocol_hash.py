# Generated from firmware/proto/dcmp.dbc; `make generate` writes it.
"""Hash that host and device compare before anything else."""

PROTOCOL_HASH = 0x074280F0
