"""Safety functions of the host: the supervisor, its monitors, and the limits."""
