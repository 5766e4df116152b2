"""Wrapping counters of the protocol."""

from hypothesis import example, given, settings
from hypothesis import strategies as st

from dcmp_hil.wire.wrapping import unwrap


def test_every_step_of_a_byte() -> None:
    for value in range(-600, 600):
        for step in range(-128, 128):
            assert unwrap(value, (value + step) & 0xFF, 8) == value + step


def test_whole_turns_either_way() -> None:
    for bits, stride in ((8, 1), (8, 127), (13, 4095), (24, (1 << 23) - 1), (24, 999_983)):
        for step in (stride, -stride):
            held = true = 0
            for _ in range(3000):
                true += step
                held = unwrap(held, true % (1 << bits), bits)
                assert held == true


@settings(deadline=None, max_examples=300)
@given(st.integers(-(1 << 40), 1 << 40), st.integers(1, 32), st.data())
def test_the_nearest_number_with_these_bits(value: int, bits: int, data: st.DataObject) -> None:
    raw = data.draw(st.integers(0, (1 << bits) - 1))
    found = unwrap(value, raw, bits)
    assert found % (1 << bits) == raw
    assert -(1 << bits) <= 2 * (found - value) < 1 << bits


@settings(deadline=None)
@given(st.integers(-(1 << 23), (1 << 23) - 1))
@example(-(1 << 23))
@example((1 << 23) - 1)
@example(-1)
def test_the_first_is_twos_complement(count: int) -> None:
    raw = int.from_bytes(count.to_bytes(3, "little", signed=True), "little")
    assert unwrap(0, raw, 24) == count
