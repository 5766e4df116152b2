"""The traces of docs/protocol.md on disk, and which of them a device does not follow."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from tools.traces import __main__ as tool
from tools.traces.steps import differences

if TYPE_CHECKING:
    from collections.abc import Callable


TRACES: dict[str, Any] = {
    path.stem: json.loads(path.read_text("utf-8")) for path in sorted(tool.FOLDER.glob("*.json"))
}


def found_by(make: Callable[..., Any]) -> list[str]:
    """Return the traces that a device does not follow."""
    return [
        name
        for name, trace in TRACES.items()
        if differences(make(carrier="can", **trace["built"]), trace["steps"])
    ]
