"""Who is there: serial ports and CAN channels, and the device on each."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dcmp_hil.backends.caller import Caller
from dcmp_hil.backends.links import make_link
from dcmp_hil.config.backends import Can, Serial
from dcmp_hil.errors import DcmpError
from dcmp_hil.faults import name_of
from dcmp_hil.wire.messages import Hello, Identity, SampleReport, State
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from dcmp_hil.clock import Clock

_LISTEN = 0.25  # s; a device sends every period, from boot on
_OTHER = 7  # fault class of every code from 7 on
_ASKS_ONLY = 0  # the session of a HELLO that owns nothing
_DRIVERS = ("socketcan", "pcan", "kvaser", "vector", "ixxat", "gs_usb")


@dataclass(frozen=True, slots=True)
class Finding:
    """What is on one port or channel.

    Parameters
    ----------
    place
        Path of a port, or interface and channel.
    description
        Of the adapter, with its serial number where it has one.
    settings
        Keys of `[backend]` that reach the device; empty if there is none.
    device
        What answered, in words.
    """

    place: str
    description: str
    settings: tuple[str, ...]
    device: str


def find_devices(extra: Sequence[str], baud: int, bitrate: int, clock: Clock) -> Iterator[Finding]:
    """Look at every serial port and CAN channel, and at ports named besides.

    It asks only where a device of ours is heard; before that it sends only what opens a line (one 0x00, and
    the slcan commands C, S8, O).

    Parameters
    ----------
    extra
        Paths of serial ports that the system does not list, such as pseudo terminals.
    baud, bitrate
        Bit/s, of serial ports and CAN buses.
    clock
        Times the listening.
    """
    for path, description in _serial_ports(extra):
        yield _look_at_serial(path, description, baud, clock)
    for interface, channel in _can_channels():
        yield _look_at_can(interface, channel, bitrate, clock)


def _serial_ports(extra: Sequence[str]) -> Iterator[tuple[str, str]]:
    from serial.tools import list_ports

    for port in sorted(list_ports.comports()):
        number = f", serial number {port.serial_number}" if port.serial_number else ""
        yield port.device, f"{port.description}{number}"
    for path in extra:
        yield path, "named on the command line"


def _can_channels() -> Iterator[tuple[str, str]]:
    import can

    logging.disable(logging.ERROR)  # every driver that is not installed says so
    try:
        configs = can.detect_available_configs(interfaces=_DRIVERS)
    finally:
        logging.disable(logging.NOTSET)
    for config in configs:
        yield config["interface"], str(config["channel"])


def _look_at_serial(path: str, description: str, baud: int, clock: Clock) -> Finding:
    first = ""
    for settings, keys in (
        (Serial(kind="serial", port=path, baud=baud), ("kind=serial", f"port={path}")),
        (
            Can(kind="can", interface="slcan", channel=path, baud=baud),
            ("kind=can", "interface=slcan", f"channel={path}"),
        ),
    ):
        answer, found = _ask(settings, clock)
        if found:
            return Finding(path, description, keys, answer)
        first = first or answer
        if answer and "nothing" not in answer and "damaged" not in answer:
            break  # it cannot even be opened
    return Finding(path, description, (), first)


def _look_at_can(interface: str, channel: str, bitrate: int, clock: Clock) -> Finding:
    settings = Can(kind="can", interface=interface, channel=channel, bitrate=bitrate)
    answer, found = _ask(settings, clock)
    keys = ("kind=can", f"interface={interface}", f"channel={channel}") if found else ()
    return Finding(f"{interface} {channel}", "CAN", keys, answer)


def _ask(settings: Serial | Can, clock: Clock) -> tuple[str, bool]:
    """Return what is at the other end, in words, and whether it is a device of ours."""
    link = make_link(settings, clock)
    try:
        link.open()
    except DcmpError as error:
        return str(error).partition(": ")[2] or str(error), False
    try:
        caller = Caller(link, clock, 0)
        node = _hear_node(caller, clock)
        if node is None:
            return ("damaged frames: another baud rate?" if link.corrupt else "nothing heard"), False
        return _describe(Caller(link, clock, node), node), True
    except DcmpError as error:
        return str(error).partition(": ")[2] or str(error), False
    finally:
        link.close()


def _hear_node(caller: Caller, clock: Clock) -> int | None:
    """Return the node of the first device heard."""
    deadline_ns = clock.now_ns() + int(1e9 * _LISTEN)
    while (left_ns := deadline_ns - clock.now_ns()) > 0:
        heard = caller.overhear(1e-9 * left_ns)
        if heard is not None and isinstance(heard[1], SampleReport):
            return heard[0]
    return None


def _describe(caller: Caller, node: int) -> str:
    identity = caller.ask(Hello(_ASKS_ONLY, PROTOCOL_HASH), Identity)
    sample = caller.hear_sample(_LISTEN)
    words = [f"node {node}"]
    if identity is None:
        words.append("does not answer")
    else:
        words.append(f"firmware {identity.firmware_version >> 8}.{identity.firmware_version & 0xFF}")
        other = "" if identity.protocol_hash == PROTOCOL_HASH else " (another than this host's)"
        words.append(f"protocol {identity.protocol_hash:08x}{other}")
        if identity.busy:
            words.append("in use by a host")
    if sample is not None:
        words.append(state_in_words(sample))
    return ", ".join(words)


def state_in_words(sample: SampleReport) -> str:
    """Name the state of a device, and its fault."""
    state = State(sample.state).name if sample.state in set(State) else f"state {sample.state}"
    if sample.state != State.FAULT:
        return state
    return f"{state} ({name_of(sample.fault_class) if sample.fault_class < _OTHER else 'see FAULT'})"
