"""The way to a device: handshake, session and end, over any link."""
