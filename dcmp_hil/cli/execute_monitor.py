"""One `dcmp-hil monitor` from opening the link to its last line."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rich.text import Text

from dcmp_hil.cli import console
from dcmp_hil.cli.streams import output_failed
from dcmp_hil.device.client import DeviceClient
from dcmp_hil.device.discovery import state_in_words
from dcmp_hil.device.links.listen_only import make_listening_link
from dcmp_hil.device.node_uniqueness import NodeUniqueness
from dcmp_hil.platform.clock import MonotonicClock
from dcmp_hil.platform.stop_request import StopRequest
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import Drive, FaultReport, Parameter, ParameterValue, SampleReport

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.wire.messages import Message

_POLL_PERIOD_S = 0.1  # s, how long a Ctrl-C waits at most
_SHOWN_INTERVAL_MIN_NS = 100_000_000  # between two SAMPLEs, or two DRIVEs, that are shown
_FREQUENT_MESSAGES = (SampleReport, Drive)


class _Brief:
    """Lets ten SAMPLEs and ten DRIVEs a second through, and everything else."""

    def __init__(self) -> None:
        self._shown: dict[tuple[int, type], int] = {}

    def lets_through(self, node: int, message: Message, now_ns: int) -> bool:
        """Return whether this message is to be shown."""
        kind = (node, type(message))
        if (
            isinstance(message, _FREQUENT_MESSAGES)
            and now_ns - self._shown.get(kind, -_SHOWN_INTERVAL_MIN_NS) < _SHOWN_INTERVAL_MIN_NS
        ):
            return False
        self._shown[kind] = now_ns
        return True


class _Ticks:
    """Warns once of a node that is there twice."""

    def __init__(self) -> None:
        self._uniqueness_of: dict[int, NodeUniqueness] = {}
        self._told: set[int] = set()

    def take(self, node: int, message: Message) -> None:
        """Process a message of a node."""
        if not isinstance(message, SampleReport) or node in self._told:
            return
        uniqueness = self._uniqueness_of.setdefault(node, NodeUniqueness())
        uniqueness.add(message)
        if uniqueness.two_devices:
            self._told.add(node)
            console.warn(f"two devices send as node {node}: their ticks jump forth and back. Unplug one.")


def watch(rig: Rig, duration: float, *, all_frames: bool) -> int:
    """Print messages for `duration` (s, 0 for ever) or until the user ends it; return the exit code."""
    clock = MonotonicClock()
    link = make_listening_link(rig.backend, clock)
    client, brief, ticks = DeviceClient(link, clock, 0), _Brief(), _Ticks()
    heard = 0
    try:
        link.open()
        console.note(f"listening on {link.name}; Ctrl-C ends it")
        began_ns = clock.now_ns()
        until_ns = began_ns + 1e9 * duration if duration else math.inf
        with StopRequest() as stop:
            while not (stop.requested or output_failed()) and (now_ns := clock.now_ns()) < until_ns:
                found = client.receive_any(_POLL_PERIOD_S)
                if found is None:
                    continue
                heard += 1
                ticks.take(*found)
                if all_frames or brief.lets_through(*found, now_ns):
                    _show(1e-9 * (now_ns - began_ns), *found)
        hint = "" if heard else link.other_carrier
    finally:
        link.close()
    damaged = link.corrupt + client.corrupt
    console.note(f"{heard} messages, {damaged} damaged frames")
    if hint:
        console.warn(f"{link.name}: a device speaks there on another carrier. Say {hint}.")
    return stop.exit_code


def _show(t: float, node: int, message: Message) -> None:
    name = type(message).__name__.removesuffix("Report")
    line = Text.assemble(f"{t:9.3f} s  {node:2}  ", (f"{name:15}", "bold"), _in_words(message))
    console.out.print(line, no_wrap=True, crop=False, overflow="ignore")


def _in_words(message: Message) -> str:
    if isinstance(message, SampleReport):
        flags = "".join(
            f" {word}" for word, on in (("missed", message.missed), ("limited", message.limited)) if on
        )
        return (
            f"tick {message.tick:3}  {message.position_counts:8} counts  {message.voltage_mV:6} mV  "
            f"{state_in_words(message)}{flags}"
        )
    if isinstance(message, FaultReport):
        name = Fault(message.code).name if message.code in set(Fault) else f"code {message.code}"
        return f"{name}  at tick {message.tick}  detail {message.detail}"
    if isinstance(message, ParameterValue) and message.id in set(Parameter):
        return f"{Parameter(message.id).name} = {message.value}  result {message.result}"
    fields = message._asdict()
    return "  ".join(f"{name} {int(value)}" for name, value in fields.items())
