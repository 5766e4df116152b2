"""Faults of a wire: what a board sends, or is sent, passed through a function."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.contract.benches import Bench

Chunk = Any  # bytes of one tick, or its list of frames


def on_way_down(bench: Bench, change: Callable[[Chunk], Chunk]) -> None:
    """Pass everything that the board sends in a tick through `change`."""
    name = "transmit_frames" if bench.carrier == "can" else "transmit"
    send = getattr(bench.board, name)
    setattr(bench.board, name, lambda: change(chunk) if (chunk := send()) else chunk)


class Dropper:
    """Loses the next `count` chunks."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, chunk: Chunk) -> Chunk:
        if self.count <= 0:
            return chunk
        self.count -= 1
        return chunk[:0]


class Doubler:
    """Sends every chunk twice."""

    def __call__(self, chunk: Chunk) -> Chunk:
        return chunk + chunk


class Swapper:
    """Holds every tenth chunk back until the next one has gone out."""

    def __init__(self) -> None:
        self._seen = 0
        self._held: Chunk | None = None

    def __call__(self, chunk: Chunk) -> Chunk:
        self._seen += 1
        held, self._held = self._held, None
        if held is not None:
            return chunk + held
        if self._seen % 10:
            return chunk
        self._held = chunk
        return chunk[:0]


class Flipper:
    """Turns over one bit of every tenth chunk, another place each time."""

    def __init__(self) -> None:
        self._seen = 0

    def __call__(self, chunk: Chunk) -> Chunk:
        self._seen += 1
        if self._seen % 10:
            return chunk
        if isinstance(chunk, list):
            number, data = chunk[0]
            return [(number, _flipped(data, self._seen)), *chunk[1:]]
        return _flipped(chunk, self._seen)


def _flipped(data: bytes, seen: int) -> bytes:
    place = seen % (8 * (len(data) - 1))  # not in the delimiter: that would join two frames
    changed = bytearray(data)
    changed[place // 8] ^= 1 << place % 8
    return bytes(changed)
