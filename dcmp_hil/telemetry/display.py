"""Whether this process could show a window."""

import os


def display_available() -> bool:
    """Tell whether an X or Wayland display is announced in the environment."""
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
