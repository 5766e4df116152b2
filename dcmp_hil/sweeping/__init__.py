"""Sweeps: many runs of one rig in virtual time, over grids and draws of its keys."""
