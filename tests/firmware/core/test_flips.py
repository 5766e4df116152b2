"""Every flip of one bit or two, of every message, on every carrier."""

from typing import Any

import fastcrc
import pytest

from tests.firmware.bench import SESSION, Bench, Core, database, encode

MESSAGES = [message.name for message in database().messages]
FILLS = ["low", "high", "55", "AA", "33", "first"]
CARRIERS = {"COBS": 0, "slcan": 1}


def _payloads(name: str) -> list[tuple[int, bytes]]:
    made = []
    message = database().get_message_by_name(name)
    for fill in FILLS:
        for node in (0, 15):
            fields = {}
            for position, signal in enumerate(message.signals):
                bits = {"low": 0, "high": -1, "first": 1 << position}.get(fill)
                raw = (int(fill * 4, 16) if bits is None else bits) & ((1 << signal.length) - 1)
                fields[signal.name] = raw - (1 << signal.length) * (
                    signal.is_signed and raw >> signal.length - 1
                )
            fields.pop("crc8")
            made.append(encode(name, node, **fields))
    return made


def _running(core: Core, node: int) -> Bench:
    """A device that takes the next DRIVE, its age and session being right."""
    bench = Bench(core, node=node)
    bench.arm()
    bench.tick()
    return bench


def _drives(bench: Bench) -> list[tuple[int, bytes]]:
    seq = bench.device.tick % 8192
    shared: dict[str, int] = {"session": SESSION, "arm": 1, "clear": 0, "release": 0}
    voltages = [0, 1, -1, 5000, -5000, 10000, -10000, 0x2AAA, -0x5555, 9728, 4660, -4660]
    return [
        encode("DRIVE", bench.config.node, voltage_mV=mv, seq=seq, ttl_ms=ttl, **shared)
        for mv in voltages
        for ttl in (5, 20, 50)
    ]


def _flip(core: Core, carrier: int, bench: Bench, made: tuple[int, bytes], two: bool) -> Any:
    # A marker that differs from every message flipped, and has zeros and letters in it.
    marker = core.frame(*encode("PARAMETER_SET", bench.config.node, session=0xABCD, id=3, value=0x00C0FFEE))
    return core.lib.check_stream_flips(carrier, bench.device, core.frame(*made), marker, two)


@pytest.mark.parametrize("name", MESSAGES)
@pytest.mark.parametrize("two", [False, True])
def test_can(core: Core, name: str, two: bool) -> None:
    for made in _payloads(name):
        flips = core.lib.check_can_flips(core.frame(*made), two)
        bits = 11 + 8 * len(made[1])
        assert flips.tried == (bits * (bits - 1) // 2 if two else bits)
        assert flips.passed == 0


@pytest.mark.parametrize("name", MESSAGES)
@pytest.mark.parametrize("two", [False, True])
def test_cobs(core: Core, name: str, two: bool) -> None:
    benches = {node: _running(core, node) for node in (0, 15)}
    for made in _payloads(name):
        flips = _flip(core, 0, benches[made[0] & 15], made, two)
        assert flips.tried > (2000 if two else 60)
        assert (flips.passed, flips.lost) == (0, 0)


@pytest.mark.parametrize("name", MESSAGES)
def test_slcan_one_bit(core: Core, name: str) -> None:
    benches = {node: _running(core, node) for node in (0, 15)}
    for made in _payloads(name):
        flips = _flip(core, 1, benches[made[0] & 15], made, False)
        assert flips.tried > 70
        assert (flips.passed, flips.lost) == (0, 0)


def test_slcan_two_bits(core: Core) -> None:
    """slcan has no checksum of its own: few pass, and no DRIVE that is accepted."""
    benches = {node: _running(core, node) for node in (0, 15)}
    tried = passed = drives = lost = 0
    for node, bench in benches.items():
        messages = [made for name in MESSAGES for made in _payloads(name) if made[0] & 15 == node]
        for made in messages + _drives(bench):
            flips = _flip(core, 1, bench, made, True)
            tried, passed = tried + flips.tried, passed + flips.passed
            drives, lost = drives + flips.drives, lost + flips.lost
    print(f"slcan, two bits: {passed} of {tried} passed, {drives} of them as accepted DRIVEs")  # noqa: T201
    assert tried > 2_000_000
    assert passed * 5000 <= tried
    assert drives == 0
    assert lost == 0


def _syndrome(*errors: tuple[int, int]) -> int:
    """Return crc8's verdict on a payload damaged so, (digit, exclusive-or): 0 is unnoticed."""
    damage = bytearray(8)
    for digit, error in errors:
        damage[digit // 2] |= error << (0 if digit % 2 else 4)
    return fastcrc.crc8.autosar(bytes(9)) ^ fastcrc.crc8.autosar(b"\0\0" + damage[:7]) ^ damage[7]


def test_every_flip_of_two_bits_that_passes_in_an_slcan_drive() -> None:
    """For any DRIVE whatever: crc8 is linear, so the damage alone decides.

    Two digits five apart, 8 in the first and 7 in the second. Session and age refuse all of them but the
    first: 128 mV and `seq` one more or less (B and C), which passes only if the DRIVE before was lost or a
    tick went by.
    """
    digits = "0123456789ABCDEF"
    one = {
        index ^ digits.index(chr(ord(digit) ^ 1 << bit))
        for index, digit in enumerate(digits)
        for bit in range(8)
        if chr(ord(digit) ^ 1 << bit) in digits
    }
    assert all(_syndrome((at, error)) for at in range(16) for error in range(1, 16))
    passing = {
        (i, x, j, y)
        for i in range(16)
        for j in range(i + 1, 16)
        for x in one
        for y in one
        if _syndrome((i, x), (j, y)) == 0
    }
    assert passing == {(i, 8, i + 5, 7) for i in range(11)}
