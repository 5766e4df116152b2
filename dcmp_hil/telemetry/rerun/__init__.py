"""The dashboard: a run as Rerun shows it, live or from a file."""
