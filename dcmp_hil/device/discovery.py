"""Discovery of serial ports and CAN channels, and of the device on each."""

from __future__ import annotations

import contextlib
import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from dcmp_hil.config.backends import Can, Serial
from dcmp_hil.device.boot_history import history_of
from dcmp_hil.device.client import DeviceClient
from dcmp_hil.device.links.listen_only import make_listening_link
from dcmp_hil.device.node_uniqueness import NodeUniqueness
from dcmp_hil.errors import ConfigError, DcmpError
from dcmp_hil.safety.device_faults import name_of
from dcmp_hil.wire.messages import Hello, Identity, SampleReport, State
from dcmp_hil.wire.protocol_hash import PROTOCOL_HASH

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from dcmp_hil.platform.clock import Clock

LISTEN_DURATION_S = 0.25  # s; a device sends every period, from boot on
_TWO_DEVICES_LISTEN_S = 1.0  # s, longer where ticks are odd
_TICK_MODULUS = 256
_OTHER_FAULT_CLASS = 7  # fault class of every code from 7 on
_NO_SESSION = 0  # the session of a HELLO that owns nothing
_CAN_DRIVERS = ("socketcan", "pcan", "kvaser", "vector", "ixxat", "gs_usb")
_KEYS_ALWAYS_SHOWN = ("kind", "port", "interface", "channel")  # that a command names always
_KEYS_WITH_DEFAULT = ("node", "baud", "bitrate")  # that it names where they are not the default


@dataclass(frozen=True, slots=True)
class FoundDevice:
    """Result for one port or channel: a device, one of several, or no device of this project.

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
    history
        Its boots, why it was reset, and its fault before that; empty unless asked for.
    """

    place: str
    description: str
    settings: tuple[str, ...]
    device: str
    history: str = ""


def find_devices(
    extra: Sequence[str],
    baud: int,
    bitrate: int,
    clock: Clock,
    wait: float = LISTEN_DURATION_S,
    *,
    history: bool = False,
) -> Iterator[FoundDevice]:
    """Yield the findings on every serial port and CAN channel, and on the named ports.

    It listens first, and writes nothing: it asks only where a device of ours was heard. Other people's
    equipment is left alone.

    Parameters
    ----------
    extra
        Paths of serial ports that the system does not list, such as pseudo terminals.
    baud, bitrate
        Bit/s, of serial ports and CAN buses.
    clock
        Times the listening.
    wait
        s, how long a device may take to its first sample.
    history
        Whether each device is asked for its past.

    Raises
    ------
    ConfigError
        If a name cannot be that of a port.
    """
    for path in extra:
        _check_name(path)
    for path, description in _serial_ports(extra):
        cobs = Serial(kind="serial", port=path, baud=baud)
        slcan = Can(kind="can", interface="slcan", channel=path, baud=baud, bitrate=bitrate)
        yield from _look_at(path, description, (cobs, slcan), clock, wait, history=history)
    for interface, channel in _can_channels():
        settings = Can(kind="can", interface=interface, channel=channel, bitrate=bitrate)
        yield from _look_at(f"{interface} {channel}", "CAN", (settings,), clock, wait, history=history)


def _check_name(path: str) -> None:
    try:
        Serial(kind="serial", port=path)
    except ValidationError as error:
        raise ConfigError(
            f'PORT: got "{path}"; expected the path of a serial port, such as /dev/ttyACM0.'
        ) from error


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
    configs: list[Any] = []
    try:
        for driver in _CAN_DRIVERS:
            with contextlib.suppress(Exception):  # drivers raise exceptions of any type
                configs.extend(can.detect_available_configs(interfaces=driver))
    finally:
        logging.disable(logging.NOTSET)
    for config in configs:
        yield config["interface"], str(config["channel"])


def _look_at(
    place: str,
    description: str,
    ways: Sequence[Serial | Can],
    clock: Clock,
    wait: float,
    *,
    history: bool,
) -> Iterator[FoundDevice]:
    """Try one way of speaking after the other, until a device is heard."""
    damaged = False
    try:
        for settings in ways:
            devices, corrupt = _ask(settings, clock, wait, history=history)
            damaged = damaged or corrupt
            for node, (words, past) in devices.items():
                yield FoundDevice(place, description, _keys(settings, node), words, past)
            if devices:
                return
    except DcmpError as error:
        remark = str(error).partition(": ")[2] or str(error)
    else:
        remark = "damaged frames: another baud rate?" if damaged else "nothing heard"
    yield FoundDevice(place, description, (), remark)


def _keys(settings: Serial | Can, node: int) -> tuple[str, ...]:
    """Return the keys of `[backend]` that reach a node."""
    values = {**settings.model_dump(), "node": node}
    usual = type(settings).model_fields
    named = [key for key in _KEYS_ALWAYS_SHOWN if key in values]
    named += [key for key in _KEYS_WITH_DEFAULT if key in values and values[key] != usual[key].default]
    return tuple(f"{key}={values[key]}" for key in named)


def _ask(
    settings: Serial | Can, clock: Clock, wait: float, *, history: bool
) -> tuple[dict[int, tuple[str, str]], bool]:
    """Return the devices at the other end and their past, in words, and whether damaged frames came."""
    link = make_listening_link(settings, clock)
    try:
        link.open()
        nodes = _hear_nodes(DeviceClient(link, clock, 0), clock, wait)
        found = {}
        for node, twice in nodes.items():
            client = DeviceClient(link, clock, node)
            words = _describe(client, node, twice=twice)
            found[node] = words, history_of(client).sentence if history else ""
        return found, link.corrupt > 0
    finally:
        link.close()


def _hear_nodes(client: DeviceClient, clock: Clock, wait: float) -> dict[int, bool]:
    """Return the nodes that were heard, and whether each is there twice.

    Two SAMPLEs, one tick after the other, are no accident; `wait` (s) is for the first.
    """
    deadline_ns = clock.now_ns() + int(1e9 * wait)
    ticks: dict[int, int] = {}
    nodes: set[int] = set()
    uniqueness_of: dict[int, NodeUniqueness] = {}
    longest_ns = deadline_ns + int(1e9 * _TWO_DEVICES_LISTEN_S)
    while (left_ns := deadline_ns - clock.now_ns()) > 0:
        heard = client.receive_any(1e-9 * left_ns)
        if heard is None:
            continue
        node, sample = heard
        if not isinstance(sample, SampleReport):
            continue
        if ticks.get(node) == (sample.tick - 1) % _TICK_MODULUS:
            if not nodes:  # from the first on no longer than usual
                deadline_ns = clock.now_ns() + int(1e9 * LISTEN_DURATION_S)
            nodes.add(node)
        ticks[node] = sample.tick
        uniqueness = uniqueness_of.setdefault(node, NodeUniqueness())
        uniqueness.add(sample)
        if uniqueness.suspicious and not uniqueness.two_devices:
            deadline_ns = max(deadline_ns, min(longest_ns, clock.now_ns() + int(1e9 * LISTEN_DURATION_S)))
    twice = {node for node, uniqueness in uniqueness_of.items() if uniqueness.two_devices}
    return {node: node in twice for node in sorted(nodes | twice)}


def _describe(client: DeviceClient, node: int, *, twice: bool) -> str:
    identity = client.request(Hello(_NO_SESSION, PROTOCOL_HASH), Identity)
    sample = client.receive_sample(LISTEN_DURATION_S)
    words = [f"node {node}"]
    if twice:
        words.append("TWO devices with this node (unplug one)")
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
    """Return state and fault of a device in words."""
    state = State(sample.state).name if sample.state in set(State) else f"state {sample.state}"
    if sample.state != State.FAULT:
        return state
    return (
        f"{state} ({name_of(sample.fault_class) if sample.fault_class < _OTHER_FAULT_CLASS else 'see FAULT'})"
    )
