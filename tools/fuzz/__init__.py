"""The firmware's core and its model under libFuzzer: `make fuzz`."""
