"""The run's own recording: an MCAP file with every cycle, every event, and what the run was."""
