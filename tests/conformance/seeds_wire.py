"""Errors on the wire: sections 1 to 4."""
# ruff: noqa: ARG002, SLF001 - an error is sown by overriding what the device does inside

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from tests.conformance.seed import Seed
from tests.contract import reference_wire as wire

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from tests.conformance.seed import Frames, Row


class Outbox(wire.Outbox):
    """Keeps fewer answers."""

    def answer(self, number: int, content: bytes) -> None:
        self.answers = [*self.answers, (number, content)][:8]


def spoil_line(cls: type[wire.Line], **changed: Any) -> type[wire.Line]:
    """Return a copy of the codec with some methods replaced."""
    return type("Spoilt", (cls,), changed)


class NamelessBits(Seed):
    def transmit_frames(self) -> Frames:
        return [
            wire.frame(7, n % 16, d[:6] + bytes([d[6] | 0x80])) if n // 16 == 7 else (n, d)
            for n, d in super().transmit_frames()
        ]


class WrongCrcSent(Seed):
    def transmit_frames(self) -> Frames:
        return [(n, d[:-1] + bytes([d[-1] ^ (n // 16 == wire.VALUE)])) for n, d in super().transmit_frames()]


class CrcNotChecked(Seed):
    def receive_frame(self, id: int, data: bytes) -> None:  # noqa: A002
        number, node = divmod(id, 16)
        right = node == self.node and number in wire.TO_DEVICE and len(data) == wire.LENGTHS[number]
        super().receive_frame(id, wire.frame(number, node, data[:-1])[1] if right else data)


class CorruptNotCounted(Seed):
    def _corrupt(self) -> None:
        super()._corrupt()
        self._crc_errors = 0


class EveryNode(Seed):
    def receive_frame(self, id: int, data: bytes) -> None:  # noqa: A002
        number, node = divmod(id, 16)
        if wire.intact(id, data) and node != self.node:
            id, data = wire.frame(number, self.node, data[:-1])  # noqa: A001
        super().receive_frame(id, data)


class ForeignIsCorrupt(Seed):
    def receive_frame(self, id: int, data: bytes) -> None:  # noqa: A002
        if id % 16 != self.node:
            self._corrupt()
        super().receive_frame(id, data)


class CobsWithoutCrc16(Seed):
    def sow(self) -> None:
        def take(_: wire.Cobs, text: bytes) -> Iterator[wire.Frame | None]:
            data = wire.cobs_decode(text) if 0 < len(text) <= wire.COBS_LONGEST else None
            if data and 5 <= len(data) <= 12 and data[1] < 8:
                yield struct.unpack("<H", data[:2])[0], data[2:-2]
            elif text:
                yield None

        self._line = spoil_line(wire.Cobs, take=take)()


class CobsKeepsTheTail(Seed):
    def sow(self) -> None:
        def feed(line: wire.Cobs, data: bytes) -> Iterator[wire.Frame | None]:
            for byte in data:
                if byte:
                    line._line = (line._line + bytes([byte]))[-13:]
                    continue
                text = bytes(line._line)
                line._line.clear()
                found = [wire.Cobs.take(line, text[at:]) for at in range(len(text))]
                frames = [one for tried in found for one in tried if one is not None]
                yield from frames[:1]
                if text and not frames:
                    yield None

        self._line = spoil_line(wire.Cobs, feed=feed)()


class EmptyFramesAreCorrupt(Seed):
    def sow(self) -> None:
        def take(line: wire.Cobs, text: bytes) -> Iterator[wire.Frame | None]:
            yield from wire.Cobs.take(line, text) if text else (None,)

        self._line = spoil_line(wire.Cobs, take=take)()


class PiecesAreLost(Seed):
    def receive(self, data: bytes) -> None:
        super().receive(data)
        self._line._line.clear()


class OneFrameARead(Seed):
    def receive(self, data: bytes) -> None:
        end = data.find(bytes([self._line.end]), 1) + 1
        super().receive(data[:end] if end else data)


class SlcanAnswers(Seed):
    def sow(self) -> None:
        def take(line: wire.Slcan, text: bytes) -> Iterator[wire.Frame | None]:
            frames = list(wire.Slcan.take(line, text))
            line.answers = line.answers.replace(b"V0101", b"V1013")
            yield from frames

        self._line = spoil_line(wire.Slcan, take=take)()


class SlcanNeverCloses(Seed):
    def transmit_frames(self) -> Frames:
        self._line.open = True
        return super().transmit_frames()

    def _send(self, number: int, content: bytes) -> None:
        self._line.open = True
        super()._send(number, content)


def slcan_seed(change: Callable[[bytes], bytes]) -> type[Seed]:
    class Taken(Seed):
        def sow(self) -> None:
            def take(line: wire.Slcan, text: bytes) -> Iterator[wire.Frame | None]:
                yield from wire.Slcan.take(line, change(text))

            self._line = spoil_line(wire.Slcan, take=take)()

    return Taken


class SlcanWithoutBel(Seed):
    def transmit(self) -> bytes:
        return super().transmit().replace(b"\a", b"")


class SkipsTicks(Seed):
    def tick(self, counts: int) -> None:
        self.tick_count += self._periods % 50 == 49
        super().tick(counts)


class SampleTwice(Seed):
    def transmit_frames(self) -> Frames:
        return [one for one in super().transmit_frames() for _ in range(1 + (one[0] // 16 == wire.SAMPLE))]


class NeverMissed(Seed):
    def _report(self, noted_mV: int, *, missed: bool, limited: bool) -> None:
        super()._report(noted_mV, missed=False, limited=limited)


class TickBehind(Seed):
    def transmit_frames(self) -> Frames:
        self.tick_count -= 20
        try:
            return super().transmit_frames()
        finally:
            self.tick_count += 20


class TickStands(Seed):
    def sow(self) -> None:
        told = self._parameters.told
        self._parameters.told = lambda id_, result: (  # type: ignore[method-assign]
            struct.pack("<BiB", id_, 7, result) if id_ == wire.TICK else told(id_, result)
        )


class CountsWhatWasSent(Seed):
    def tick(self, counts: int) -> None:
        super().tick(counts)
        unsent = not self._line.open or self._outbox.overruns > self.seen_overruns
        self.seen_overruns = self._outbox.overruns
        self.tick_count -= unsent and self.tick_count > 0

    seen_overruns = 0


class HealthSeldom(Seed):
    def _send(self, number: int, content: bytes) -> None:
        if number != wire.HEALTH or self._periods % (2 * self._tenth_s) == 0:
            super()._send(number, content)


class HealthFalls(Seed):
    def tick(self, counts: int) -> None:
        self._bus_offs = 3 - self._periods // 150 % 3
        super().tick(counts)


class FewAnswers(Seed):
    def sow(self) -> None:
        self._outbox = Outbox()


class EdgesUnasked(Seed):
    def tick(self, counts: int) -> None:
        super().tick(counts)
        self._send(wire.EDGE, bytes(7))


SEEDS: dict[str, Row] = {
    "bits without a name are set": (NamelessBits, "can", "frames"),
    "answers have a wrong crc8": (WrongCrcSent, "can", "frames"),
    "crc8 is not checked": (CrcNotChecked, "can", "wrong-crc8"),
    "corrupt frames are not counted": (CorruptNotCounted, "cobs", "wrong-crc8"),
    "frames of every node are obeyed": (EveryNode, "can", "foreign-frames"),
    "frames of others are errors": (ForeignIsCorrupt, "cobs", "foreign-frames"),
    "crc16 is not checked": (CobsWithoutCrc16, "cobs", "cobs-damage"),
    "the tail of a long frame is read": (CobsKeepsTheTail, "cobs", "cobs-damage"),
    "empty frames are errors": (EmptyFramesAreCorrupt, "cobs", "cobs-damage"),
    "a frame in two pieces is lost": (PiecesAreLost, "cobs", "split-frames"),
    "one frame a read": (OneFrameARead, "slcan", "split-frames"),
    "V is answered otherwise": (SlcanAnswers, "slcan", "slcan-commands"),
    "C does not close": (SlcanNeverCloses, "slcan", "slcan-commands"),
    "lower-case hex is taken": (slcan_seed(lambda t: t[:1] + t[1:].upper()), "slcan", "slcan-lines"),
    "t with length 0 is taken": (
        slcan_seed(lambda t: b"" if t[4:] == b"0" else t), "slcan", "slcan-lines",
    ),
    "the eighth bit is dropped": (
        slcan_seed(lambda t: bytes(byte & 127 for byte in t)), "slcan", "slcan-lines",
    ),
    "no BEL": (SlcanWithoutBel, "slcan", "slcan-lines"),
    "the counter skips": (SkipsTicks, "can", "sample-counter"),
    "every SAMPLE is sent twice": (SampleTwice, "can", "sample-counter"),
    "missed is never said": (NeverMissed, "can", "sample-counter"),
    "TICK is behind": (TickBehind, "can", "tick-parameter"),
    "TICK stands": (TickStands, "can", "tick-parameter"),
    "the counter counts what was sent, slcan": (CountsWhatWasSent, "slcan", "counter-goes-on"),
    "the counter counts what was sent": (CountsWhatWasSent, "cobs", "counter-goes-on"),
    "HEALTH comes every 200 ms": (HealthSeldom, "can", "health"),
    "counters of HEALTH fall": (HealthFalls, "can", "health"),
    "eight answers wait": (FewAnswers, "can", "answers"),
    "EDGE comes unasked": (EdgesUnasked, "can", "edge-stamps"),
}  # fmt: skip
