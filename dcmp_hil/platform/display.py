"""Check whether this process has a display for a window."""

from __future__ import annotations

import os
import subprocess

from dcmp_hil.platform.python_command import python_command

_CONNECT_TIMEOUT_S = 20.0  # s for a display that is far away, or frozen; one that is gone is known at once
_CONNECT_CODE = """
import ctypes, sys
library, function = sys.argv[1:]
connect = getattr(ctypes.CDLL(library), function)
connect.restype = ctypes.c_void_p
sys.exit(not connect(None))
"""
_KINDS = (  # in the order in which the viewer takes them
    ("WAYLAND_DISPLAY", "libwayland-client.so.0", "wl_display_connect"),
    ("DISPLAY", "libX11.so.6", "XOpenDisplay"),
)


def display_available() -> bool:
    """Return whether the environment names an X or Wayland display."""
    return any(os.environ.get(name) for name, _, _ in _KINDS)


def display_problem() -> str:
    """Return why no window can be shown; empty if one can.

    The display is opened as the viewer does it, with the system's own library and the user's cookie, in a
    process of its own: a library that ends its process, or a display that is frozen, costs nothing else.
    """
    for name, library, function in _KINDS:
        if not (value := os.environ.get(name)):
            continue
        try:
            done = subprocess.run(  # noqa: S603 - our own code
                python_command(_CONNECT_CODE, library, function, isolated=True),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=_CONNECT_TIMEOUT_S,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired):
            return f"the display {name}={value} does not answer"
        return f"the display {name}={value} cannot be opened" if done.returncode else ""
    return "there is no display (neither DISPLAY nor WAYLAND_DISPLAY is set)"
