"""A page on this machine to change tunable keys of a run, and to stop it."""
