"""The wire protocol of docs/protocol.md, sans I/O: messages to bytes and back, no ports, no time."""
