"""Frames over CAN, through any interface that python-can has."""

from __future__ import annotations

import contextlib
import select
import termios
from typing import TYPE_CHECKING

import can
import serial

from dcmp_hil.config.backends import Can as CanSettings
from dcmp_hil.device.backend import DeviceBackend
from dcmp_hil.device.links import socketcan
from dcmp_hil.device.links.port_errors import reason
from dcmp_hil.device.links.serial import path_of
from dcmp_hil.device.links.slcan import SlcanBus
from dcmp_hil.errors import ConfigError, DcmpError, LinkError, OpenError

if TYPE_CHECKING:
    from dcmp_hil.config import Rig
    from dcmp_hil.platform.clock import Clock
    from dcmp_hil.wire.frame import Frame

FAILURES = (
    can.CanError,
    serial.SerialException,
    OSError,
    termios.error,
    ValueError,
    TypeError,
    AttributeError,
)
"""What interfaces of python-can raise when they fail; the last two come from ports that are closed."""

_NETWORK_DRIVERS = ("socketcand", "udp_multicast")
_BLOCKING_INTERFACES = (
    "robotell",
    "seeedstudio",
    "serial",
)  # they write without a bound: a frozen device would hold us
_BUS_OFF = 0x40  # of the identifier of socketcan's error frames
_DAMAGE_CLASSES = 0x08 | 0x10 | 0x80  # there: protocol violation, transceiver, bus error
_FOREIGN_FRAMES_MAX = 64  # frames that are passed over in one look; a bus full of errors is no reason to stay
_POLL_PERIOD_NS = 100_000  # between two looks at an interface that cannot be waited on


def open_can(rig: Rig, clock: Clock) -> DeviceBackend:
    """Make the backend of a device on a CAN bus."""
    settings = rig.backend
    if not isinstance(settings, CanSettings):
        raise ConfigError(f'backend.kind: got "{settings.kind}"; expected "can".')
    return DeviceBackend(rig, CanLink(settings, clock), clock)


def listen(settings: CanSettings, clock: Clock) -> CanLink:
    """Return a link that only listens until a frame is sent."""
    return CanLink(settings, clock, listen_only=True)


class CanLink:
    """A CAN bus.

    Waiting is done here and not in python-can, whose timeouts count on the wall clock.

    Parameters
    ----------
    settings
        Interface, channel, bit rate.
    clock
        Slept on between two looks, where the interface has nothing that can be waited on.
    listen_only
        An slcan adapter is left as it is: nothing is written but what is sent.
    """

    def __init__(self, settings: CanSettings, clock: Clock, *, listen_only: bool = False) -> None:
        self.name = f"{settings.interface} {settings.channel}"
        self._settings, self._clock, self._listen_only = settings, clock, listen_only
        self._bus: can.BusABC | None = None
        self._corrupt = 0  # of the bus that was closed last
        self._poll: select.poll | None = None

    @property
    def corrupt(self) -> int:
        """Number of corrupt frames so far: lines of slcan, error frames of socketcan and some others."""
        return self._bus.corrupt if isinstance(self._bus, SlcanBus) else self._corrupt

    @property
    def other_carrier(self) -> str:
        """Settings for COBS, if that is what an slcan port was heard to speak."""
        if not (isinstance(self._bus, SlcanBus) and self._bus.is_cobs):
            return ""
        return f"--set backend.kind=serial --set backend.port={self._settings.channel}"

    @property
    def pending(self) -> bool:
        """Whether to look again: interfaces hand frames out one by one."""
        return True

    def open(self) -> None:
        """Open the interface.

        Raises
        ------
        OpenError
            If there is no such interface or channel, or it cannot be opened.
        ConfigError
            If the interface is not one for a motor, or python-can has no such one.
        """
        self._bus = bus = _open_bus(self._settings, listen_only=self._listen_only)
        try:
            poll = select.poll()
            poll.register(bus.fileno(), select.POLLIN)
            if self._settings.interface == "socketcan":
                self._check_up(bus)
        except (NotImplementedError, *FAILURES):
            return  # it is looked at instead
        except BaseException:
            self.close()
            raise
        self._poll = poll

    def close(self) -> None:
        """Close the interface."""
        self._corrupt = self.corrupt
        bus, self._bus, self._poll = self._bus, None, None
        if bus is None:
            return
        with contextlib.suppress(*FAILURES):  # it is gone: that is closed
            bus.shutdown()

    def send(self, frame: Frame) -> None:
        """Send a frame; what the interface has no room for is dropped.

        Raises
        ------
        LinkError
            If the interface failed.
        """
        number, data = frame
        message = can.Message(arbitration_id=number, data=data, is_extended_id=False, check=False)
        try:
            self._opened().send(message, timeout=0)
        except can.CanOperationError as error:
            if not _is_full(error):
                raise self._broken(error) from error
        except FAILURES as error:
            raise self._broken(error) from error

    def receive(self, timeout: float) -> Frame | None:
        """Return the next frame; None if none came within `timeout` (s) of silence.

        Raises
        ------
        LinkError
            If the interface failed, or the bus went off.
        """
        frame = self._look()
        if frame is not None or timeout <= 0.0:
            return frame
        if self._poll is not None:
            return self._look() if self._poll.poll(1e3 * timeout) else None
        deadline_ns = self._clock.now_ns() + int(1e9 * timeout)
        while frame is None and (now_ns := self._clock.now_ns()) < deadline_ns:
            self._clock.sleep_until_ns(min(now_ns + _POLL_PERIOD_NS, deadline_ns))
            frame = self._look()
        return frame

    def _look(self) -> Frame | None:
        """Return a frame that is there; remote and extended ones are not ours."""
        bus = self._opened()
        try:
            for _ in range(_FOREIGN_FRAMES_MAX):
                message = bus.recv(0.0)
                if message is None:
                    return None
                if message.is_error_frame:
                    self._corrupt += self._is_damage(message)
                    self._check_bus(message)
                elif not (message.is_extended_id or message.is_remote_frame or message.is_fd):
                    return message.arbitration_id, bytes(message.data)
        except FAILURES as error:
            raise self._broken(error) from error
        return None

    def _check_up(self, bus: can.BusABC) -> None:
        """Poll once: an interface that is down can be opened, and fails at the first poll only."""
        try:
            bus.recv(0.0)
        except can.CanError as error:
            if socketcan.is_down(error):
                raise socketcan.was_down(self._settings) from error
            raise self._broken(error) from error

    def _is_damage(self, message: can.Message) -> bool:
        """Whether an error frame tells of a frame that was damaged; socketcan tells of more than that."""
        return self._settings.interface != "socketcan" or message.arbitration_id & _DAMAGE_CLASSES != 0

    def _check_bus(self, message: can.Message) -> None:
        if message.arbitration_id & _BUS_OFF:
            raise LinkError(
                f"{self.name}: bus-off. The device goes to 0 V by itself. Check termination (120 ohm at both "
                "ends), bit rate and wiring, then "
                f"bring the interface up again: ip link set {self._settings.channel} down, then up."
            )

    def _opened(self) -> can.BusABC:
        if self._bus is None:
            raise LinkError(f"{self.name}: not open. Use the backend as a context manager.")
        return self._bus

    def _broken(self, error: BaseException) -> LinkError:
        if socketcan.is_down(error):
            return socketcan.went_down(self._settings)
        return LinkError(
            f"{self.name}: the connection broke ({reason(error)}). The device goes to 0 V by itself. Look at "
            "adapter, cable and bus, then start again."
        )


def _open_bus(settings: CanSettings, *, listen_only: bool) -> can.BusABC:
    _check_interface(settings)
    interface, channel = settings.interface, settings.channel
    try:
        if interface == "slcan":
            return SlcanBus(path_of(str(channel)), settings.baud, settings.bitrate, listen_only=listen_only)
        if interface == "socketcan":
            socketcan.check_there(settings)
        return can.Bus(
            channel=channel,
            interface=interface,
            bitrate=settings.bitrate,
            ignore_config=True,
            **settings.options,
        )
    except DcmpError:
        raise
    except (ImportError, can.CanInterfaceNotImplementedError) as error:
        raise OpenError(
            f"{interface}: its driver is missing: {_on_one_line(error)}. See python-can's page of it."
        ) from error
    except Exception as error:  # drivers raise exceptions of any type
        raise _cannot_open(settings, error) from error


def _check_interface(settings: CanSettings) -> None:
    interface = settings.interface
    if interface in _NETWORK_DRIVERS:
        raise ConfigError(
            f'backend.interface: "{interface}" reaches over the network; a motor is driven from the machine '
            "that it is plugged into."
        )
    if interface in _BLOCKING_INTERFACES:
        raise ConfigError(
            f'backend.interface: python-can\'s "{interface}" may wait for ever in a write. On a serial line '
            'use interface = "slcan", or backend.kind = "serial".'
        )
    if interface != "virtual" and interface not in can.VALID_INTERFACES:
        raise ConfigError(
            f'backend.interface: python-can has no "{interface}". It has: '
            f"{', '.join(sorted(can.VALID_INTERFACES))}."
        )
    if interface == "slcan" and settings.options:
        raise ConfigError(
            f"backend.options: got {', '.join(settings.options)}; slcan takes none. It is set up by channel, "
            "baud and bitrate."
        )


def _cannot_open(settings: CanSettings, error: BaseException) -> OpenError:
    cause = error
    while cause.__cause__ is not None:
        cause = cause.__cause__
    hint = (
        f"the interface is up: ip link set {settings.channel} up type can bitrate {settings.bitrate}."
        if settings.interface == "socketcan"
        else "its driver is installed."
    )
    return OpenError(
        f"{settings.interface} {settings.channel}: cannot be opened: {_on_one_line(cause)}. Check "
        f"backend.channel and that {hint}"
    )


def _on_one_line(error: BaseException) -> str:
    return " ".join(str(error).split()).rstrip(".") or type(error).__name__


def _is_full(error: can.CanOperationError) -> bool:
    """Whether the adapter's queue is full: no node acknowledges, or the bus is busier than the adapter."""
    words = str(error).lower()
    return "full" in words or "buffer space" in words or "could not send message" in words
