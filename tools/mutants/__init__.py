"""`python -m tools.mutants`: break the safety C one piece at a time, and see whether a test notices."""
