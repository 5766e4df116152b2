"""`python -m tools.mutants`: break the firmware's safety C one piece at a time, and see whether a test notices."""
