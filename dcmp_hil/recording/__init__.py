"""The run's own recording: an MCAP file with every period, every event, and what the run was."""
