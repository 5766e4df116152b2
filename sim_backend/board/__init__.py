"""The firmware on a simulated board: its C core in this process, or as a process behind a pseudo terminal."""
