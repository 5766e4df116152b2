"""A host that is written from docs/protocol.md, for devices behind one interface."""

from __future__ import annotations

import struct
from typing import NamedTuple, Protocol

from tests.contract import reference_wire as wire
from tests.contract.reference_wire import RUN

OUR_SESSION, OTHER_SESSION = 0x1234, 0x4321
HASH = wire.protocol_hash()


class Device(Protocol):
    now_us: int

    @property
    def applied_mV(self) -> int: ...
    @property
    def enable(self) -> bool: ...
    def receive(self, data: bytes) -> None: ...
    def transmit(self) -> bytes: ...
    def receive_frame(self, id: int, data: bytes) -> None: ...  # noqa: A002 - the interface's word
    def transmit_frames(self) -> list[tuple[int, bytes]]: ...
    def tick(self, counts: int) -> None: ...
    def advance(self, us: int) -> None: ...
    def link(self, up: bool) -> None: ...


class Sample(NamedTuple):
    position: int
    voltage_mV: int
    tick: int
    state: int
    missed: bool
    limited: bool
    fault_class: int


class Host:
    """The other end: joins ticks from boot on, keeps the newest message of each kind and counts them all."""

    def __init__(self, device: Device, carrier: str, *, node: int, first_tick: int) -> None:
        self.device = device
        self.node = node
        self.line = {"cobs": wire.Cobs, "slcan": wire.Slcan, "can": wire.Line}[carrier]()
        self.carrier = carrier
        self.ticks = first_tick - 1  # of the newest SAMPLE
        self.counts = 0
        self.seen: list[tuple[int, bytes]] = []

    def send(self, number: int, content: bytes, *, node: int | None = None, spoil: int = 0) -> None:
        identifier, data = wire.frame(number, self.node if node is None else node, content)
        data = data[:-1] + bytes([data[-1] ^ spoil])
        if self.carrier == "can":
            self.device.receive_frame(identifier, data)
        else:
            self.device.receive(self.line.pack([(identifier, data)]))

    def collect(self) -> list[tuple[int, bytes]]:
        """Return the messages that wait: number and content without crc8."""
        carried = self.carrier != "can"
        frames = self.line.feed(self.device.transmit()) if carried else self.device.transmit_frames()
        out = []
        for frame in frames:
            assert frame is not None
            identifier, data = frame
            assert wire.intact(identifier, data)
            assert identifier % 16 == self.node
            assert len(data) == wire.LENGTHS[identifier // 16]
            out.append((identifier // 16, data[:-1]))
        self.seen += out
        return out

    def tick(self, moved: int = 0) -> Sample:
        self.counts += moved
        self.device.tick(self.counts)
        self.ticks += 1
        contents = [content for number, content in self.collect() if number == wire.SAMPLE]
        assert len(contents) == 1
        voltage_mV, tick, flags = struct.unpack("<hBB", contents[0][3:])
        assert tick == self.ticks & 255
        position = int.from_bytes(contents[0][:3], "little")
        return Sample(position, voltage_mV, tick, flags & 7, bool(flags & 8), bool(flags & 16), flags >> 5)

    def drive(
        self,
        voltage_mV: int = 0,
        *,
        arm: int = 0,
        clear: int = 0,
        release: int = 0,
        back: int = 0,
        session: int = OUR_SESSION,
        ttl_ms: int = 50,
    ) -> None:
        """Answer the SAMPLE `back` before the newest."""
        word = (self.ticks - back) % 8192 * 8 + arm + 2 * clear + 4 * release
        self.send(wire.DRIVE, struct.pack("<hHHB", voltage_mV, word, session, ttl_ms))

    def hello(self, session: int = OUR_SESSION, hash_: int = HASH) -> str:
        """Return the letters of the flags that IDENTITY says."""
        self.send(wire.HELLO, struct.pack("<HI", session, hash_))
        ((number, content),) = self.collect()
        assert number == wire.IDENTITY
        assert struct.unpack("<I", content[:4]) == (HASH,)
        return "".join(letter for bit, letter in enumerate("bom") if content[6] >> bit & 1)

    def get(self, id_: int) -> tuple[int, int]:
        """Return result and value."""
        self.send(wire.GET, bytes([id_]))
        return self.value(id_)

    def put(self, id_: int, value: int, session: int = OUR_SESSION) -> tuple[int, int]:
        self.send(wire.SET, struct.pack("<HBi", session, id_, value))
        return self.value(id_)

    def value(self, id_: int) -> tuple[int, int]:
        ((number, content),) = self.collect()
        said, value, result = struct.unpack("<BiB", content)
        assert (number, said) == (wire.VALUE, id_)
        return result, value

    def newest(self, number: int) -> bytes:
        return next(content for n, content in reversed(self.seen) if n == number)

    def fault(self) -> tuple[int, int, int]:
        """Return code, tick and detail of the newest FAULT."""
        code, tick, detail = struct.unpack("<BBi", self.newest(wire.FAULT))
        return code, tick, detail

    def health(self) -> dict[str, int]:
        """Let HEALTH come."""
        self.seen.clear()
        while not any(number == wire.HEALTH for number, _ in self.seen):
            self.tick()
        names = ("crc_errors", "sequence_gaps", "ring_overruns", "bus_offs", "late_ticks", "idle_percent")
        return dict(zip(names, self.newest(wire.HEALTH), strict=True))

    def arm(self) -> Sample:
        """From IDLE to RUN, as section 10 does it."""
        assert self.hello() == "o"
        for _ in range(10):
            self.tick()
            self.drive(arm=1)
        sample = self.tick()
        assert sample.state == RUN
        return sample

    def run(self, ticks: int, voltage_mV: int = 0, moved: int = 0) -> Sample:
        for _ in range(ticks - 1):
            self.drive(voltage_mV, arm=1)
            self.tick(moved)
        self.drive(voltage_mV, arm=1)
        return self.tick(moved)
