"""The changes that were made while a run went on, found again in its events."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from dcmp_hil.errors import ConfigError
from dcmp_hil.live.tunables import changed
from dcmp_hil.values import ChangeData

if TYPE_CHECKING:
    from collections.abc import Sequence

    from dcmp_hil.config import Rig
    from dcmp_hil.control.change import Change
    from dcmp_hil.values import Event


def changes_in(events: Sequence[Event], rig: Rig, *, whole: bool = True) -> list[tuple[float, Change]]:
    """Return each change with the device time of the period after which it was made, s.

    Parameters
    ----------
    events
        Of the run.
    rig
        As the run began.
    whole
        Whether no event is missing: else a change that does not fit is left out.

    Raises
    ------
    ConfigError
        If one of them cannot be made with this rig.
    """
    found = []
    for event in events:
        if isinstance(event.data, ChangeData) and event.data.values:
            # JSON's numbers and texts are TOML's, and come back to the bit.
            overrides = [f"{key}={json.dumps(value)}" for key, value in event.data.values.items()]
            try:
                rig, change = changed(rig, overrides, variation=False)
            except ConfigError:
                if whole:
                    raise
                continue
            found.append((event.t, change))
    return found
