"""Fault plans: what goes wrong with a simulated rig on purpose, by level: wire, firmware, plant, host."""
