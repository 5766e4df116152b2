"""Result of a run: figures, columns, events, device and link."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from dcmp_hil.config import Rig
    from dcmp_hil.device.disarm import DeviceEnd
    from dcmp_hil.platform.realtime import Grant
    from dcmp_hil.safety.polarity_check import MotorGain
    from dcmp_hil.telemetry.statistics import Summary
    from dcmp_hil.values import Event
    from dcmp_hil.wire.link_diagnosis import Concern, LinkCounters


@dataclass(frozen=True, slots=True)
class Result:
    """Result of a run: its figures, columns and events, and how device and link fared.

    Parameters
    ----------
    rig
        What was run.
    summary
        The figures.
    columns
        Every signal of the table, shape (periods,), by name with unit; `time_s` is device time. Empty if
        columns were not kept.
    events
        What happened, in order.
    periods
        How many the whole run had.
    dropped
        Periods that telemetry lost because a sink was slow; they are in no figure.
    link
        What was lost or damaged on the way and survived; None where there is no wire.
    link_concerns
        What of it is more than `backend.warn_percent` and `backend.warn_clock_percent` allow, and its cause.
    device_end
        State and fault in which the device was left; None where there is none, or it did not say.
    grants
        What was asked of the operating system and what came of it; empty in virtual time.
    host
        What is known of the computer; see `host_facts`.
    overruns
        Late periods of the whole run, by what `timing.overrun` calls late.
    outliers
        Samples left out because no arm can have been where they say.
    troubles
        Its first hundred warnings and errors, with their time; kept where events are not, too.
    changes
        What was changed while it went on, in words.
    motor_gain
        What the probe found of the motor; None without a probe.
    compared
        Kinds of observers that were asked for beside the loop.
    last_columns
        With those, where columns were not kept: the columns of the last cycles, as many as the ring holds.
    engine
        What ran the cycles: "core", or "plain", the loop of the host. Both give the same bits.
    engine_reason
        Why it was not the core, in virtual time, in a sentence; empty otherwise.
    """

    rig: Rig
    summary: Summary
    columns: dict[str, NDArray[np.float64]]
    events: tuple[Event, ...]
    periods: int = 0
    dropped: int = 0
    link: LinkCounters | None = None
    link_concerns: tuple[Concern, ...] = ()
    device_end: DeviceEnd | None = None
    grants: tuple[Grant, ...] = ()
    host: dict[str, Any] = field(default_factory=dict)
    overruns: int = 0
    outliers: int = 0
    troubles: tuple[str, ...] = ()
    changes: tuple[str, ...] = ()
    motor_gain: MotorGain | None = None
    compared: tuple[str, ...] = ()
    last_columns: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    engine: str = "plain"
    engine_reason: str = ""
