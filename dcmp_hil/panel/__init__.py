"""A page on this machine to turn a run's knobs with, and to stop it."""
