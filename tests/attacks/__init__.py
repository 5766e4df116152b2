"""Attacks on purpose, one file a row: a controller, a file, a disk, a flood, another user, a wrong rig."""
