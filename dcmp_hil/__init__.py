"""The bridge between a host-side real-time control loop and the firmware of a lab servo.

    >>> from dcmp_hil import load_rig, run
    >>> result = run(load_rig("bench-1khz"), duration=1.0, fast=True)
    >>> result.summary.periods
    1000

Names are imported on first use, so that `import dcmp_hil` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dcmp_hil.config import Rig, load_rig
    from dcmp_hil.errors import BackendError, ConfigError, DcmpError, TripError
    from dcmp_hil.session import Result, run
    from dcmp_hil.telemetry.statistics import Summary

__version__ = "0.1.0"

_HOMES = {
    "BackendError": "dcmp_hil.errors",
    "ConfigError": "dcmp_hil.errors",
    "DcmpError": "dcmp_hil.errors",
    "Result": "dcmp_hil.session",
    "Rig": "dcmp_hil.config",
    "Summary": "dcmp_hil.telemetry.statistics",
    "TripError": "dcmp_hil.errors",
    "load_rig": "dcmp_hil.config",
    "run": "dcmp_hil.session",
}

__all__ = [
    "BackendError",
    "ConfigError",
    "DcmpError",
    "Result",
    "Rig",
    "Summary",
    "TripError",
    "__version__",
    "load_rig",
    "run",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
