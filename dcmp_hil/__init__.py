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
    from dcmp_hil.api import run, simulate
    from dcmp_hil.backend import Backend
    from dcmp_hil.config import Rig, load_rig
    from dcmp_hil.control.controllers import Controller, ControllerContext
    from dcmp_hil.control.model import Model
    from dcmp_hil.control.observers import Observer, ObserverContext
    from dcmp_hil.errors import BackendError, ConfigError, DcmpError, DeadlineError, TripError
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.result import Result
    from dcmp_hil.sweeping.api import sweep
    from dcmp_hil.sweeping.result import SweepResult
    from dcmp_hil.telemetry.recorder import Sink
    from dcmp_hil.telemetry.statistics import Summary
    from dcmp_hil.values import Cycle, Estimate, Event, Fault, Reference, Sample, Truth

__version__ = "0.1.0"

_HOMES = {
    "Backend": "dcmp_hil.backend",
    "BackendError": "dcmp_hil.errors",
    "Clock": "dcmp_hil.platform.clock",
    "ConfigError": "dcmp_hil.errors",
    "Controller": "dcmp_hil.control.controllers",
    "ControllerContext": "dcmp_hil.control.controllers",
    "Cycle": "dcmp_hil.values",
    "DcmpError": "dcmp_hil.errors",
    "DeadlineError": "dcmp_hil.errors",
    "Estimate": "dcmp_hil.values",
    "Event": "dcmp_hil.values",
    "Fault": "dcmp_hil.values",
    "Model": "dcmp_hil.control.model",
    "Observer": "dcmp_hil.control.observers",
    "ObserverContext": "dcmp_hil.control.observers",
    "Reference": "dcmp_hil.values",
    "Result": "dcmp_hil.result",
    "Rig": "dcmp_hil.config",
    "Sample": "dcmp_hil.values",
    "Sink": "dcmp_hil.telemetry.recorder",
    "Summary": "dcmp_hil.telemetry.statistics",
    "SweepResult": "dcmp_hil.sweeping.result",
    "TripError": "dcmp_hil.errors",
    "Truth": "dcmp_hil.values",
    "load_rig": "dcmp_hil.config",
    "run": "dcmp_hil.api",
    "simulate": "dcmp_hil.api",
    "sweep": "dcmp_hil.sweeping.api",
}

__all__ = [
    "Backend",
    "BackendError",
    "Clock",
    "ConfigError",
    "Controller",
    "ControllerContext",
    "Cycle",
    "DcmpError",
    "DeadlineError",
    "Estimate",
    "Event",
    "Fault",
    "Model",
    "Observer",
    "ObserverContext",
    "Reference",
    "Result",
    "Rig",
    "Sample",
    "Sink",
    "Summary",
    "SweepResult",
    "TripError",
    "Truth",
    "__version__",
    "load_rig",
    "run",
    "simulate",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)
