"""Counters that wrap: differences and continuation."""


def unwrap(value: int, raw: int, bits: int) -> int:
    """Return the number closest to `value` whose lowest bits are `raw`.

    Parameters
    ----------
    value
        The number before; 0 makes the first one two's complement.
    raw
        What the wire says, 0 to 2**bits - 1.
    bits
        How many bits of the number travel.
    """
    half = 1 << (bits - 1)
    return value + ((raw - value + half) & (2 * half - 1)) - half
