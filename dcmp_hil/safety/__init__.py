"""What keeps arm and motor safe on the host's side: the supervisor, its monitors, and the limits."""
