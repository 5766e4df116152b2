"""From a port's name to a carrier: named, or found by listening."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.config.backends import Can
from dcmp_hil.conformance.lines import CanLine, CobsLine, SerialPort, SlcanLine
from dcmp_hil.conformance.terms import CAN, COBS, SLCAN
from dcmp_hil.device.links.serial import path_of
from dcmp_hil.errors import OpenError
from dcmp_hil.wire import cobs, slcan
from dcmp_hil.wire.codec import CorruptFrameError, unpack
from dcmp_hil.wire.messages import SampleReport

if TYPE_CHECKING:
    from dcmp_hil.conformance.lines import CarrierLine
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame

_LISTEN_DURATION_S = 2.0  # a board that resets when its port is opened has booted by then
_SAMPLES_MIN = 3  # SAMPLEs that are no accident


def open_line(
    port: str, link: str | None, *, interface: str, baud: int, bitrate: int, node: int, clock: Clock
) -> CarrierLine:
    """Open a port and return the carrier on it.

    Parameters
    ----------
    port
        Path or serial number of a serial port; channel of a CAN interface.
    link
        `cobs`, `slcan` or `can`; None listens on a serial port for the first two.
    interface
        Of python-can.
    baud, bitrate
        Bit/s, of serial ports and CAN buses.
    node
        Of the device.
    clock
        Bounds the listening.

    Raises
    ------
    OpenError
        If the port cannot be opened, or no carrier is understood.
    ConfigError
        If there is no such interface.
    """
    if link == CAN:
        settings = Can(kind="can", interface=interface, channel=port, bitrate=bitrate)
        return CanLine(settings, clock)
    opened = SerialPort(path_of(port), baud)
    try:
        found = link or _listen(opened, node, clock)
        return SlcanLine(opened) if found == SLCAN else CobsLine(opened)
    except BaseException:
        opened.close()
        raise


def _listen(port: SerialPort, node: int, clock: Clock) -> str:
    """Return the carrier in which SAMPLEs come; nothing is written."""
    receivers: dict[str, cobs.CobsDecoder | slcan.SlcanDecoder] = {
        COBS: cobs.CobsDecoder(),
        SLCAN: slcan.SlcanDecoder(),
    }
    samples = dict.fromkeys(receivers, 0)
    came = 0
    deadline_ns = clock.now_ns() + int(1e9 * _LISTEN_DURATION_S)
    while clock.now_ns() < deadline_ns:
        data = port.read(0.1)
        came += len(data)
        for carrier, receiver in receivers.items():
            samples[carrier] += sum(_is_sample(frame, node) for frame in receiver.feed(data))
            if samples[carrier] >= _SAMPLES_MIN:
                return carrier
    heard = f"{came} bytes came, but no SAMPLE of node {node}" if came else "nothing came"
    raise OpenError(
        f"{port.name}: {heard} within {_LISTEN_DURATION_S:g} s. Look at --baud, --node, cable and supply; "
        "name the carrier by --link cobs or --link slcan if the device is silent until it is opened."
    )


def _is_sample(frame: Frame, node: int) -> bool:
    try:
        return isinstance(unpack(frame, node), SampleReport)
    except CorruptFrameError:
        return False
