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


DIGITS = "0123456789ABCDEF"
STEPS = {
    (old, new)
    for old in range(16)
    for new in range(16)
    if (ord(DIGITS[old]) ^ ord(DIGITS[new])).bit_count() == 1
}
"""Hex digits that one flipped bit turns into one another."""
AGE_MAX_PERIODS = 31  # periods; the device takes a DRIVE no older than 3 ms, 30 periods at 10 kHz


def _may_be_accepted(first: int, x: int, second: int, y: int) -> bool:
    """Whether some DRIVE of a host, damaged so in two digits, is a DRIVE that its device may accept.

    Digits 0-3 are the voltage, 4-7 flags and seq, 8-11 the session, 12-13 the ttl, 14-15 crc8.
    """
    if any(8 <= digit < 12 for digit in (first, second)):
        return False  # another session
    for olds in [(a, b) for a, _ in STEPS for b, _ in STEPS if (a, a ^ x) in STEPS and (b, b ^ y) in STEPS]:
        changes = dict(zip((first, second), zip(olds, (olds[0] ^ x, olds[1] ^ y), strict=True), strict=True))
        if _word_may_be(changes) and _ttl_may_be(changes):
            return True
    return False


def _word_may_be(changes: dict[int, tuple[int, int]]) -> bool:
    """Look at every word of flags and seq that a host sends and these changes apply to."""
    place = {4: 4, 5: 0, 6: 12, 7: 8}
    inside = {place[digit]: change for digit, change in changes.items() if digit in place}
    for word in range(1 << 16):
        flags, seq = word & 7, word >> 3
        if flags.bit_count() > 1 or any((word >> at) & 15 != old for at, (old, _) in inside.items()):
            continue
        damaged = word
        for at, (old, new) in inside.items():
            damaged ^= (old ^ new) << at
        ahead = ((damaged >> 3) - seq + AGE_MAX_PERIODS) % 8192
        if (damaged & 7).bit_count() <= 1 and ahead <= 2 * AGE_MAX_PERIODS:
            return True
    return False


def _ttl_may_be(changes: dict[int, tuple[int, int]]) -> bool:
    """Look at every ttl that a host sends and these changes apply to."""
    inside = {(13 - digit) * 4: change for digit, change in changes.items() if digit in (12, 13)}
    for ttl in range(5, 51):
        damaged = ttl
        for at, (old, new) in inside.items():
            damaged = -1 if (ttl >> at) & 15 != old else damaged ^ (old ^ new) << at
        if 5 <= damaged <= 50:
            return True
    return False


def test_no_two_flipped_bits_in_an_slcan_drive_make_one_that_is_accepted() -> None:
    """For every DRIVE: crc8 is linear, so the damage alone decides whether it passes."""
    one = {old ^ new for old, new in STEPS}
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
    assert [damage for damage in sorted(passing) if _may_be_accepted(*damage)] == []


def test_the_proof_sees_damage_that_would_be_accepted() -> None:
    assert _may_be_accepted(0, 1, 1, 1)  # the voltage alone
    assert _may_be_accepted(13, 1, 14, 1)  # 20 ms and 21
    assert not _may_be_accepted(0, 1, 9, 1)
