"""A device on a table: virtual time, a count to turn, frames in and out as cantools reads them."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import cantools
import fastcrc
from cantools.database.can import Database
from cobs import cobs  # type: ignore[import-untyped]

from tests.firmware.core_library import DBC

if TYPE_CHECKING:
    from cffi import FFI

SESSION = 0x1234
CONFIG = {
    "board": 1,
    "boot_count": 7,
    "reset_cause": 1,
    "counts_per_rev": 4096,
    "period_us": 1000,
    "voltage_limit_mV": 10000,
    "slew_mV_per_ms": 0,
    "watchdog_ms": 20,
    "speed_limit_counts_s": 40000,
    "travel_limit_counts": 20000,
    "last_fault": 5,
    "last_fault_detail": -41234,
    "supply_mV": 24000,
    "firmware_version": 0x0102,
    "node": 0,
    "edge_stamps": True,
}

Fields = dict[str, Any]


@functools.cache
def database() -> Database:
    """Return the DBC file as a cantools database."""
    read = cantools.database.load_file(DBC)
    assert isinstance(read, Database)
    return read


def encode(name: str, node: int = 0, **fields: int) -> tuple[int, bytes]:
    """Return identifier and payload as cantools and fastcrc make them."""
    message = database().get_message_by_name(name)
    number = message.frame_id + node
    body = message.encode({**fields, "crc8": 0}, strict=False)[:-1]
    return number, body + bytes([fastcrc.crc8.autosar(number.to_bytes(2, "little") + body)])


def decode(number: int, payload: bytes) -> tuple[str, Fields]:
    """Return name and fields as cantools reads them; the checksum must be right."""
    message = database().get_message_by_frame_id(number & 0x7F0)
    assert len(payload) == message.length
    assert fastcrc.crc8.autosar(number.to_bytes(2, "little") + payload[:-1]) == payload[-1]
    fields = message.decode(payload, decode_choices=False)
    assert isinstance(fields, dict)
    fields.pop("crc8")
    return message.name, fields


def stuff(body: bytes, spoil: int = 0) -> bytes:
    """Return bytes with their crc16 (or another) in a COBS frame, as the cobs package makes it."""
    return bytes(cobs.encode(body + (fastcrc.crc16.ibm_3740(body) ^ spoil).to_bytes(2, "little"))) + b"\0"


def cobs_wire(number: int, payload: bytes, spoil: int = 0) -> bytes:
    """Return a frame on a COBS line."""
    return stuff(number.to_bytes(2, "little") + payload, spoil)


def slcan_wire(number: int, payload: bytes) -> bytes:
    """Return a frame on an slcan line."""
    return f"t{number:03X}{len(payload)}{payload.hex().upper()}\r".encode()


def unstuff(data: bytes) -> bytes:
    """Return what a COBS frame without its delimiter holds; nothing if it is none."""
    try:
        return bytes(cobs.decode(data))
    except cobs.DecodeError:
        return b""


class Core:
    """The firmware core, loaded as a library."""

    def __init__(self, ffi: FFI, lib: Any) -> None:
        self.ffi = ffi
        self.lib = lib

    def new(self, kind: str, *value: Any) -> Any:
        """Return a structure or an array of the core's."""
        return self.ffi.new(kind, *value)

    def frame(self, number: int, payload: bytes) -> Any:
        """Return a frame of the core's."""
        return self.ffi.new("struct dcmp_frame *", (number, len(payload), list(payload.ljust(8, b"\0"))))

    def read(self, frame: Any) -> tuple[int, bytes]:
        """Return a frame's identifier and payload."""
        return frame.id, bytes(frame.data[0 : frame.length])

    def config(self, **changes: Any) -> Any:
        """Return a board's configuration."""
        return self.ffi.new("struct dcmp_config *", {**CONFIG, **changes})


class Bench:
    """One device, and a host that does as it is told."""

    def __init__(self, core: Core, *, start: int = 0, boot: bool = True, **config: Any) -> None:
        self.core = core
        self.lib = core.lib
        self.config: Any = core.config(**config)
        self.device: Any = core.new("struct dcmp_device *")
        self.now = start
        self.counts = 0
        self.sample: Fields = {}
        self.seen: list[tuple[str, Fields]] = []
        self.valid: bool = self.lib.dcmp_device_init(self.device, self.config, self.now)
        if boot:
            self.tick()

    @property
    def state(self) -> int:
        """Return the device's state."""
        return int(self.device.supervisor.state)

    @property
    def fault(self) -> tuple[int, int]:
        """Return the latched fault's code and detail."""
        return self.device.supervisor.fault.code, self.device.supervisor.fault.detail

    def advance(self, microseconds: int) -> None:
        """Let time pass, without a tick."""
        self.now = (self.now + microseconds) & 0xFFFFFFFF

    def output(self) -> tuple[int, bool]:
        """Return the voltage, mV, and ENABLE of the amplifier."""
        out = self.lib.dcmp_device_output(self.device, self.now)
        return out.voltage_mV, out.enable

    def tick(self, times: int = 1, edge: Any = None) -> tuple[int, bool]:
        """Run ticks; take the frames that were sent; return voltage and ENABLE."""
        out = None
        for _ in range(times):
            self.advance(self.config.period_us)
            stamp = self.core.ffi.NULL if edge is None else edge
            out = self.lib.dcmp_device_tick(self.device, self.now, self.counts & 0xFFFFFFFF, stamp)
            self.take()
        assert out is not None
        return out.voltage_mV, out.enable

    def take(self) -> list[tuple[str, Fields]]:
        """Return the frames that wait to be sent, decoded."""
        frame = self.core.new("struct dcmp_frame *")
        taken = []
        while self.lib.dcmp_device_transmit(self.device, frame):
            number, payload = self.core.read(frame)
            assert number & 0xF == self.config.node
            taken.append(decode(number, payload))
        for name, fields in taken:
            if name == "SAMPLE":
                self.sample = fields
        self.seen += taken
        return taken

    def send(self, name: str, **fields: int) -> None:
        """Send a message."""
        number, payload = encode(name, self.config.node, **fields)
        self.lib.dcmp_device_receive(self.device, self.core.frame(number, payload), self.now)

    def ask(self, name: str, **fields: int) -> Fields:
        """Send a message and return its answer."""
        self.take()
        self.send(name, **fields)
        answers = self.take()
        assert len(answers) == 1
        return answers[0][1]

    def hello(self, session: int = SESSION, wrong: int = 0) -> Fields:
        """Ask to own the device."""
        return self.ask("HELLO", session=session, protocol_hash=self.lib.check_protocol_hash() ^ wrong)

    def drive(self, voltage: int = 0, *, age: int = 0, **fields: int) -> bool:
        """Send a DRIVE; return whether it was accepted."""
        filled = {"seq": (self.device.tick - age) % 8192, "arm": 1, "clear": 0, "release": 0}
        filled |= {"session": SESSION, "ttl_ms": 50} | fields
        before, self.device.driven = self.device.driven, False
        self.send("DRIVE", voltage_mV=voltage, **filled)
        accepted = bool(self.device.driven)
        self.device.driven = before or accepted
        return accepted

    def arm(self) -> None:
        """Own the device and bring it to RUN, at a tick."""
        self.hello()
        for _ in range(10):
            assert self.drive()
            self.tick()
        assert self.state == self.lib.DCMP_RUN

    def run(self, voltage: int = 5000) -> None:
        """Arm, and put a voltage out."""
        self.arm()
        assert self.drive(voltage)
        assert self.tick() == (voltage, True)

    def corrupt(self, times: int = 1) -> None:
        """Send corrupt frames."""
        for _ in range(times):
            self.lib.dcmp_device_corrupt(self.device, self.now)

    def go_to(self, state: int) -> None:
        """Bring a device that has just booted to a state."""
        if state == self.lib.DCMP_ARMING:
            self.hello()
            self.drive()
            self.tick()
        elif state == self.lib.DCMP_RUN:
            self.arm()
        elif state == self.lib.DCMP_FAULTED:
            self.send("STOP", reason=3)
            self.hello()
        else:
            self.hello()
        assert self.state == state
