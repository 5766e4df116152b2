"""Why a device is not in RUN any more, as far as its frames say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.values import Fault
from dcmp_hil.wire.codec import CorruptFrameError, unpack
from dcmp_hil.wire.messages import SampleReport, State
from dcmp_hil.wire.wrapping import unwrap

if TYPE_CHECKING:
    from dcmp_hil.device.links.base import Link
    from dcmp_hil.platform.clock import Clock

_OTHER_FAULT_CLASS = 7  # fault_class that only says: see FAULT
_LISTENING_PERIODS, _TICK_DISTANCE_MAX = 3, 8  # how long is listened; ticks that follow the newest one


def why_left(report: SampleReport, told: int) -> int:
    """Return the fault in a SAMPLE that does not say RUN; `told` is the newest that FAULT named."""
    if report.fault_class == Fault.NONE:
        return Fault.DISARMED
    if report.fault_class < _OTHER_FAULT_CLASS:
        return report.fault_class
    return told or Fault.UNKNOWN


def another_runs(link: Link, clock: Clock, node: int, ticks: tuple[int, int], period: float) -> bool:
    """Listen for three periods whether a device goes on in RUN under this node: then there are two.

    Parameters
    ----------
    link
        Open.
    clock
        Bounds the listening.
    node
        Of the device.
    ticks
        Of the newest SAMPLE that said RUN, and of the one that did not; their low bytes count.
    period
        s.
    """
    last, strange = ticks
    step = unwrap(0, strange - last, 8)
    first = step if 1 <= step <= _TICK_DISTANCE_MAX else 1  # that of one device comes after all of its own
    until_ns = clock.now_ns() + int(1e9 * _LISTENING_PERIODS * period)
    while (left_ns := until_ns - clock.now_ns()) > 0:
        frame = link.receive(1e-9 * left_ns)
        try:
            message = None if frame is None else unpack(frame, node)
        except CorruptFrameError:
            continue
        if isinstance(message, SampleReport) and message.state == State.RUN:
            return first <= unwrap(0, message.tick - last, 8) <= _TICK_DISTANCE_MAX + _LISTENING_PERIODS
    return False
