"""Times of a run that are no key of its rig: they come with the command."""

from __future__ import annotations

import math

from dcmp_hil.errors import ConfigError


def check_times(length: float, window_from: float, *, fast: bool) -> None:
    """Check how long a run lasts, and from when on it is judged.

    Parameters
    ----------
    length
        s; 0 is until stopped.
    window_from
        s, device time from which the figures count.
    fast
        Whether time is virtual.

    Raises
    ------
    ConfigError
        If there is no such run.
    """
    if not 0.0 <= length < math.inf:
        raise ConfigError(f"duration: got {length}; expected seconds, 0 (until Ctrl-C) or more.")
    if not 0.0 <= window_from < (length or math.inf):
        raise ConfigError(
            f"from: got {window_from} s, outside the run of {length:g} s. "
            "Choose an earlier start of the window, or a longer duration."
        )
    if fast and length == 0.0:
        raise ConfigError("duration: 0 (until Ctrl-C) and virtual time would never end. Give a duration.")
