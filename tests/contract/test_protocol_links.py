"""What docs/protocol.md says of the link and of its carriers, asked of two devices."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import pytest

from tests.contract import reference_wire as wire
from tests.contract.firmware_device import Firmware
from tests.contract.reference_wire import FAULTED, IDLE, RUN

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.contract.protocol_host import Host


def test_ten_corrupt_frames_among_a_hundred(running: Host) -> None:
    for _ in range(9):
        running.send(wire.HELLO, bytes(6), spoil=0x80)
        running.send(wire.STOP, b"\0", node=2)  # not one of the hundred
    assert running.run(1).state == RUN
    assert running.run(100, 500).state == RUN  # forgotten
    for _ in range(9):
        running.send(wire.HELLO, bytes(6), spoil=0x80)
    assert running.device.applied_mV == 500
    running.send(wire.STOP, b"\0", spoil=1)
    assert running.device.applied_mV == 0
    assert running.tick().fault_class == wire.CORRUPT_LINK
    assert running.fault()[2] == 10


def test_link_down(running: Host) -> None:
    running.run(3, 500)
    running.send(wire.GET, bytes([wire.TICK]))
    running.device.link(up=False)
    running.device.advance(2000)
    assert (running.device.applied_mV, running.device.enable) == (0, False)
    assert running.device.transmit() == b""
    running.device.link(up=True)
    sample = running.tick()
    assert (sample.state, sample.fault_class) == (FAULTED, wire.LINK_DOWN)
    assert not any(number == wire.VALUE for number, _ in running.seen)


def test_a_blocked_link_never_brings_old_samples(ready: Host) -> None:
    if isinstance(ready.device, Firmware):
        pytest.skip("its library empties the device at every call; tests/firmware/core asks the core itself")
    for _ in range(20):
        ready.send(wire.GET, bytes([wire.TICK]))
    for _ in range(4):
        ready.device.tick(0)
    ready.ticks += 4
    ready.tick()
    numbers = [number for number, _ in ready.seen[-17:]]
    assert numbers == [wire.SAMPLE] + 16 * [wire.VALUE]
    assert {struct.unpack("<i", content[1:5])[0] for _, content in ready.seen[-16:]} == {ready.ticks}
    assert ready.health()["ring_overruns"] == 4


def test_cobs_is_in_step_again_after_a_zero(host: Callable[..., Host]) -> None:
    h = host(carrier="cobs")
    h.tick()
    h.device.receive(b"\0\0\0")
    h.hello(0)
    h.device.receive(b"\x05\x11\0")  # no such block
    h.device.receive(b"\x02\x11" * 4 + b"\0")
    h.device.receive(b"\x01" * 40 + b"\0")
    stop = h.line.pack([wire.frame(wire.STOP, 0, b"\0")]).strip(b"\0")
    h.device.receive(stop[:-1] + bytes([stop[-1] ^ 1]) + b"\0")
    above = struct.pack("<H", 0x810) + b"\0\1"
    h.device.receive(wire.cobs_encode(above + struct.pack("<H", wire.crc16(above))) + b"\0")
    assert h.tick().state == IDLE
    assert h.health()["crc_errors"] == 5
    for byte in stop + b"\0":
        h.device.receive(bytes([byte]))
    assert h.tick().state == FAULTED


def test_slcan_commands(host: Callable[..., Host]) -> None:
    h = host(carrier="slcan")
    h.tick()

    def says(line: bytes) -> bytes:
        h.device.receive(line + b"\r")
        return h.device.transmit()

    stop = f"t0102{wire.frame(wire.STOP, 0, b'+')[1].hex()}"
    assert [says(line) for line in (b"O", b"L", b"S8", b"s031C", b"s00031C")] == 5 * [b"\r"]
    assert (says(b"V"), says(b"N"), says(b"F"), says(b"")) == (b"V0101\r", b"NDCMP\r", b"F00\r", b"")
    assert says(b"T000000102AABB") == says(b"r0102") == says(b"R000000102") == says(b"t7FF1AA") == b""
    bad = (
        stop.encode(),
        b"t0103AABB",
        b"t0100",
        b"t8001AA",
        b"X",
        b"S",
        b"t0101\xc1A",
        b"V" * 40,
        b"\nV",
        b"R01",
    )
    assert [says(line) for line in bad] == len(bad) * [b"\a"]
    assert h.health()["crc_errors"] == len(bad)
    assert says(b"C") == b"\r"
    h.device.tick(0)
    assert says(b"") == b""
    assert says(b"V") == b"V0101\r"
    h.ticks += 1
    assert says(b"O") == b"\r"
    assert h.tick().state == IDLE
    assert says(stop.upper().replace("T", "t").encode()) == b""
    assert h.tick().state == FAULTED
