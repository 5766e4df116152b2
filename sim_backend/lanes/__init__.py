"""Runs of a sweep side by side, in lanes of the core."""
