"""Does a device do what docs/protocol.md says? Checks that speak the page alone, against any port."""
