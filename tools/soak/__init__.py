"""Hours of a run's data through the real processes, and what their memory does."""
