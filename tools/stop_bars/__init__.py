"""Traces of the firmware's core, step by step: what goes in, and what the device then is."""
