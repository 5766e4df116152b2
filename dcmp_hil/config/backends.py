"""The kinds of `[backend]`: the ways to a device."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field

from dcmp_hil.common.section import Section
from dcmp_hil.config.sections import Custom

_COBS_PAIR_BITS = 2 * 14 * 10  # bits of a DRIVE and a SAMPLE on the wire, start and stop bits included
_SLCAN_PAIR_BITS = 2 * 22 * 10
_CAN_PAIR_BITS_MAX = 270  # the longest pair of classic frames, stuff bits and all


class Capacity(NamedTuple):
    """Rate of a link, and how many bits one cycle needs."""

    key: str  # of [backend], that sets it
    bits_per_second: int
    bits_per_period: int


class Traits:
    """Properties of a kind of backend, for rules, warnings, fault plans and the dashboard."""

    simulated: ClassVar[bool] = False
    """Whether the plant is that of [sim]; of a module:Factory it is not known before it is made."""
    device: ClassVar[bool] = False
    """Whether it is a device that speaks the project's protocol."""

    @property
    def capacity(self) -> Capacity | None:
        """Rate of the link, and what one cycle needs of it; None if the rate is no limit."""
        return None


class BackendSettings(Traits, Section):
    """The settings of a kind of `[backend]` that is part of the project."""

    factory: ClassVar[str]
    """`module:factory` that makes the backend; it takes (rig, clock)."""
    listener: ClassVar[str] = ""
    """`module:factory` of a link that only listens, of a device on a wire; it takes (settings, clock)."""

    if TYPE_CHECKING:

        @property
        def kind(self) -> str:
            """The word in rig.toml; each kind has a field of this name."""
            ...


class Sim(BackendSettings):
    """The simulated rig, without a wire."""

    simulated: ClassVar[bool] = True
    factory: ClassVar[str] = "sim_backend.backend:SimBackend"
    kind: Literal["sim"] = "sim"
    """The simulated rig: plant, encoder and amplifier behind read and write."""


class Device(BackendSettings):
    """Settings common to all backends with a device on a wire."""

    device: ClassVar[bool] = True
    node: Annotated[int, Field(ge=0, le=15)] = 0
    """Number of the device on a shared bus."""
    watchdog_ms: Annotated[int, Field(ge=5, le=50)] = 20
    """The device goes to 0 V when it receives nothing valid for this time, ms."""
    boot_wait_s: Annotated[float, Field(ge=0.5, le=60)] = 3.0
    """Time from the opening of the port to the device's first sample, at most, s: a board may boot."""
    warn_percent: Annotated[float, Field(ge=0.01, le=100)] = 0.5
    """A run warns when more than this share of its samples or commands is lost or damaged, %."""
    warn_clock_percent: Annotated[float, Field(ge=0.01, le=100)] = 0.5
    """A run warns when the device's clock deviates more than this from this computer's, %."""


class SimBoard(Device):
    """The firmware's own C in this process, the simulated plant on its pins, real bytes in between."""

    simulated: ClassVar[bool] = True
    factory: ClassVar[str] = "sim_backend.board.backend:SimBoardBackend"
    kind: Literal["sim-board"]
    """The firmware's core compiled for this computer; needs a C compiler."""
    carrier: Literal["cobs", "slcan", "can"] = "cobs"
    """How frames travel."""


class Serial(Device):
    """A device on a serial port, COBS-framed."""

    factory: ClassVar[str] = "dcmp_hil.device.links.serial:open_serial"
    listener: ClassVar[str] = "dcmp_hil.device.links.serial:listen"
    kind: Literal["serial"]
    """A serial port (pyserial)."""
    port: Annotated[str, Field(min_length=1, max_length=200, examples=["/dev/ttyACM0"])]
    """Path of the port, or the serial number of its USB adapter; `dcmp-hil ports` lists both."""
    baud: Annotated[int, Field(ge=9600, le=12_000_000)] = 1_000_000
    """Bits per second; a USB device that is no adapter ignores it."""

    @property
    def capacity(self) -> Capacity | None:
        """Rate of the serial line, and what one cycle needs of it."""
        return Capacity("baud", self.baud, _COBS_PAIR_BITS)


class Can(Device):
    """A device on a CAN bus."""

    factory: ClassVar[str] = "dcmp_hil.device.links.can:open_can"
    listener: ClassVar[str] = "dcmp_hil.device.links.can:listen"
    kind: Literal["can"]
    """A CAN interface (python-can)."""
    interface: Annotated[str, Field(min_length=1, max_length=40, examples=["socketcan"])] = "socketcan"
    """Interface as python-can names it: socketcan, slcan, pcan, kvaser, vector, gs_usb, virtual ..."""
    channel: Annotated[str | int, Field(examples=["can0"])] = "can0"
    """Channel of that interface: can0, PCAN_USBBUS1, 0, /dev/ttyACM0 ..."""
    bitrate: Annotated[int, Field(ge=10_000, le=1_000_000)] = 1_000_000
    """Bit rate, bit/s; socketcan takes it from `ip link` instead."""
    baud: Annotated[int, Field(ge=9600, le=12_000_000)] = 1_000_000
    """Bits per second of the serial line under interface = "slcan"."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Options that are passed to python-can's interface unchanged, such as `fd = false`."""

    @property
    def capacity(self) -> Capacity | None:
        """Rate of the bus or of the serial line to its adapter; None for a virtual bus."""
        if self.interface == "virtual":
            return None
        if self.interface == "slcan":
            return Capacity("baud", self.baud, _SLCAN_PAIR_BITS)
        return Capacity("bitrate", self.bitrate, _CAN_PAIR_BITS_MAX)


class CustomBackend(Traits, Custom):
    """A backend of your own: `kind = "module:Factory"`, made as Factory(rig, clock)."""
