"""Faults of a line: what is sent in one piece arrives changed, late, twice, or not at all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from sim_backend.faults.fault_model import Choice, FaultModel, Kind, Number

if TYPE_CHECKING:
    import random
    from collections.abc import Iterable

    from sim_backend.board.board import Board
    from sim_backend.faults.fault_model import RigFacts, Value

Way = Literal["up", "down"]
"""`up`: from host to device."""

_WAY = Choice(("both", "up", "down"))
_BURST_PIECES_MAX = 25  # pieces, the longest burst


def _probability(default: float) -> Number:
    return Number("", 0.0, 1.0, default)


class WireFault(FaultModel):
    """A piece in, pieces out; on CAN a piece is a frame, its identifier in front."""

    def __init__(self, facts: RigFacts, rng: random.Random, **params: Value) -> None:
        super().__init__(facts, rng, **params)
        self._way = str(params.get("way", "both"))

    def affects(self, way: Way) -> bool:
        """Whether the fault is active for this direction."""
        return self.on and self._way in ("both", way)

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:  # noqa: ARG002
        """Return the pieces that arrive at once after `piece` was sent."""
        return (piece,)

    def released(self, way: Way) -> list[bytes]:  # noqa: ARG002
        """Return what arrives now of earlier pieces; asked once a period, on or off."""
        return []


class RandomFault(WireFault):
    """Changes each piece with probability `p`."""

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:  # noqa: ARG002
        """Return the pieces that arrive, changed at random."""
        return self.spoil(piece) if self.rng.random() < self.number("p") else (piece,)

    def spoil(self, piece: bytes) -> Iterable[bytes]:  # noqa: ARG002
        """Return what becomes of a piece that is changed: nothing."""
        return ()


class Drop(RandomFault):
    """Drops pieces, a number of them in a row."""

    _left: dict[Way, int]

    def begin(self) -> None:
        """Reset the number of pieces still to drop."""
        self._left = {"up": 0, "down": 0}

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:
        """Return nothing where a piece is lost."""
        if self._left[way] == 0 and self.rng.random() < self.number("p"):
            self._left[way] = round(self.number("burst"))
        if self._left[way]:
            self._left[way] -= 1
            return ()
        return (piece,)


class Duplicate(RandomFault):
    """Sends a piece twice."""

    def spoil(self, piece: bytes) -> Iterable[bytes]:
        """Return the piece twice."""
        return piece, piece


class Flip(RandomFault):
    """Turns bits over, never the delimiter's own: that is losing and inserting."""

    def spoil(self, piece: bytes) -> Iterable[bytes]:
        """Return the piece with bits turned over."""
        changed = bytearray(piece)
        end = len(piece) - (self.facts.carrier != "can")
        for place in self.rng.sample(range(8 * end), min(round(self.number("bits")), 8 * end)):
            changed[place // 8] ^= 1 << place % 8
        return (bytes(changed),)


class BitErrors(WireFault):
    """Turns every bit over with the same small probability, those of a delimiter too."""

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:  # noqa: ARG002
        """Return the piece with bits turned over."""
        changed, rate = bytearray(piece), self.number("rate")
        for place in range(8 * len(piece)):
            if self.rng.random() < rate:
                changed[place // 8] ^= 1 << place % 8
        return (bytes(changed),)


class Truncate(RandomFault):
    """Loses the last bytes of a piece, its delimiter first: two pieces merge."""

    def spoil(self, piece: bytes) -> Iterable[bytes]:
        """Return the piece without its end."""
        return (piece[: max(0, len(piece) - round(self.number("bytes")))],)


class Insert(RandomFault):
    """Puts random bytes at a random place into a piece."""

    def spoil(self, piece: bytes) -> Iterable[bytes]:
        """Return the piece with bytes inside."""
        place = self.rng.randrange(len(piece) + 1)
        return (piece[:place] + self.rng.randbytes(round(self.number("bytes"))) + piece[place:],)


class Garbage(RandomFault):
    """Sends random bytes before a piece."""

    def spoil(self, piece: bytes) -> Iterable[bytes]:
        """Return noise, then the piece."""
        return self.rng.randbytes(round(self.number("bytes"))), piece


class Garble(RandomFault):
    """Turns a piece into noise of its length, as another bit rate does."""

    def spoil(self, piece: bytes) -> Iterable[bytes]:
        """Return noise of the same length."""
        return (self.rng.randbytes(len(piece)),)


class Timed(WireFault):
    """Keeps pieces for later."""

    def __init__(self, facts: RigFacts, rng: random.Random, **params: Value) -> None:
        super().__init__(facts, rng, **params)
        self._now = 0
        self._waiting: dict[Way, list[tuple[int, bytes]]] = {"up": [], "down": []}

    def keep(self, piece: bytes, way: Way, periods: int) -> None:
        """Delay a piece by a number of periods."""
        self._waiting[way].append((self._now + periods, piece))

    def released(self, way: Way) -> list[bytes]:
        """Return the delayed pieces that are due now."""
        if way == "up":  # asked first in every period
            self._now += 1
        waiting = self._waiting[way]
        if not waiting:
            return []
        self._waiting[way] = [item for item in waiting if item[0] > self._now]
        return [piece for due, piece in waiting if due <= self._now]


class Delay(Timed):
    """Every piece arrives later by the same time."""

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:
        """Return nothing now; the piece comes later."""
        self.keep(piece, way, self.periods("ms"))
        return ()


class Reorder(Timed):
    """Keeps a piece back until later ones have overtaken it."""

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:
        """Return the piece, or delay it."""
        if self.rng.random() >= self.number("p"):
            return (piece,)
        self.keep(piece, way, 1 + self.rng.randrange(round(self.number("depth"))))
        return ()


class Stall(Timed):
    """Stops for a while, then everything comes in one burst."""

    _until = 0

    def begin(self) -> None:
        """Start to hold."""
        self._until = self._now + self.periods("ms")

    def change(self, piece: bytes, way: Way) -> Iterable[bytes]:
        """Return no pieces while the fault is active."""
        if self._now >= self._until:
            return (piece,)
        self.keep(piece, way, self._until - self._now)
        return ()


class Unplug(FaultModel):
    """The line hangs up; with an end it is plugged in again."""

    _board: Board | None = None

    def tick(self, board: Board | None) -> None:
        """Unplug the line in the first period."""
        if board is not None and self._board is None:
            self._board = board
            board.link(up=False)

    def end(self) -> None:
        """Plug in again."""
        if self._board is not None:
            self._board.link(up=True)
            self._board = None


_BYTES = Number("bytes", 1, 32, 4)
WIRE = {
    "wire.drop": Kind(
        Drop,
        "pieces are lost, `burst` in a row",
        {"p": _probability(0.1), "burst": Number("", 1, _BURST_PIECES_MAX, 1), "way": _WAY},
        wired=True,
    ),
    "wire.dup": Kind(Duplicate, "pieces come twice", {"p": _probability(0.2), "way": _WAY}, wired=True),
    "wire.delay": Kind(Delay, "pieces come late", {"ms": Number("ms", 1, 500, 5), "way": _WAY}, wired=True),
    "wire.reorder": Kind(
        Reorder,
        "pieces overtake one another",
        {"p": _probability(0.1), "depth": Number("", 1, 100, 3), "way": _WAY},
        wired=True,
    ),
    "wire.flip": Kind(
        Flip,
        "bits are turned over",
        {"p": _probability(0.02), "bits": Number("bits", 1, 3, 1), "way": _WAY},
        wired=True,
    ),
    "wire.noise": Kind(
        BitErrors,
        "bits are turned over, each with `rate`",
        {"rate": _probability(0.001), "way": _WAY},
        wired=True,
    ),
    "wire.truncate": Kind(
        Truncate,
        "the end of a piece is lost",
        {"p": _probability(0.02), "bytes": _BYTES, "way": _WAY},
        wired=True,
    ),
    "wire.insert": Kind(
        Insert,
        "bytes appear inside a piece",
        {"p": _probability(0.02), "bytes": _BYTES, "way": _WAY},
        wired=True,
    ),
    "wire.garbage": Kind(
        Garbage,
        "noise between pieces",
        {"p": _probability(0.02), "bytes": _BYTES, "way": _WAY},
        wired=True,
    ),
    "wire.garble": Kind(Garble, "noise instead of pieces", {"p": _probability(1.0), "way": _WAY}, wired=True),
    "wire.hold": Kind(
        Stall, "silence, then a burst", {"ms": Number("ms", 1, 2000, 200), "way": _WAY}, wired=True
    ),
    "wire.blackhole": Kind(RandomFault, "nothing arrives", {"p": _probability(1.0), "way": _WAY}, wired=True),
    "wire.unplug": Kind(Unplug, "the line hangs up", wired=True),
}
