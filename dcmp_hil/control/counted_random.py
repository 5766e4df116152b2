"""Random numbers by number, not by order: the same from Python, from C, and in any order of runs.

Philox4x32-10 of Salmon, Moraes, Dror and Shaw (Parallel random numbers: as easy as 1, 2, 3; SC11, 2011): ten
rounds of two products turn a counter and a key into four words. What follows is made of exact and elementary
operations alone; `firmware/core/dcmp_random.h` is the same text in C.
"""

from __future__ import annotations

from math import sqrt

from dcmp_hil.control.elementary import logarithm, sine

ENCODER_NOISE, LOST_SAMPLES, FIRST_FREE_STREAM = range(3)
"""Streams of a simulation: their numbers are independent of each other."""

_WORD = 0xFFFF_FFFF
_FACTOR_0, _FACTOR_1 = 0xD251_1F53, 0xCD9E_8D57
_KEY_STEP_0, _KEY_STEP_1 = 0x9E37_79B9, 0xBB67_AE85
_ROUNDS = 10
_TWO_26, _UNIT = 67108864.0, 1.1102230246251565e-16  # 2**26 and 2**-53
_TWO_PI = 6.283185307179586


class CountedRandom:
    """One stream of random numbers, each asked for by its number.

    Parameters
    ----------
    seed
        Any whole number that is not negative; its lowest 64 bits are the key.
    stream
        32 bits.
    """

    def __init__(self, seed: int, stream: int) -> None:
        self._keys = philox_keys(seed & _WORD, seed >> 32 & _WORD)
        self._stream = stream & _WORD

    def words(self, counter: int) -> tuple[int, int, int, int]:
        """Return the four words of 32 bits of a counter of 64 bits."""
        return philox((counter & _WORD, counter >> 32 & _WORD, self._stream, 0), self._keys)

    def uniform(self, counter: int) -> float:
        """Return a number from 0 to below 1, a multiple of 2**-53."""
        high, low, _, _ = self.words(counter)
        return _fraction(high, low)

    def normal(self, counter: int) -> float:
        """Return a number of the normal distribution, mean 0 and deviation 1, after Box and Muller (1958)."""
        high, low, turn_high, turn_low = self.words(counter)
        radius = sqrt(-2.0 * logarithm(_fraction(high, low) + _UNIT))
        return radius * sine(_TWO_PI * (_fraction(turn_high, turn_low) - 0.5))


def philox_keys(low: int, high: int) -> list[tuple[int, int]]:
    """Return the keys of the ten rounds from the two words of a key."""
    return [(low + n * _KEY_STEP_0 & _WORD, high + n * _KEY_STEP_1 & _WORD) for n in range(_ROUNDS)]


def philox(block: tuple[int, int, int, int], keys: list[tuple[int, int]]) -> tuple[int, int, int, int]:
    """Return the four words of Philox4x32-10 of a block of four words."""
    a, b, c, d = block
    for low, high in keys:
        first, second = _FACTOR_0 * a, _FACTOR_1 * c
        a, b, c, d = second >> 32 ^ b ^ low, second & _WORD, first >> 32 ^ d ^ high, first & _WORD
    return a, b, c, d


def _fraction(high: int, low: int) -> float:
    return ((high >> 5) * _TWO_26 + (low >> 6)) * _UNIT
