"""The text of a small observer for modules that tests write."""

from __future__ import annotations

OBSERVER_TEXT = """
from dcmp_hil import Estimate

class Obs:
    def __init__(self, context, gain=1.0):
        self.gain = gain

    def update(self, sample):
        return Estimate(sample.position, 0.0, 0.0)
"""
