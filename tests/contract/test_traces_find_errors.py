"""Errors in a device that the traces find: in its states, its limits and its C."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

import pytest

from sim_backend.board import hostlib
from sim_backend.compiling import build
from tests.conformance.seeded import SEEDS
from tests.contract.firmware_device import Firmware
from tests.contract.reference_device import ReferenceDevice
from tests.contract.reference_motion import Motion
from tests.contract.traces import found_by

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    Limits = Sequence[tuple[int, int]]
    Speeds = tuple[int, int]

IN_STATES = (
    *("nine DRIVEs arm", "arming goes on over gaps", "arming with a voltage", "silence in ARMING is a fault"),
    *("silence in ARMING is nothing", "clear needs no DRIVE without it", "two sessions clear a fault"),
    *("clear with a voltage", "clear does not disarm", "release clears a fault", "the last cause stays"),
    *("corrupt frames never end RUN", "the voltage stays after RUN", "a period too much of age"),
    *("a period too little of age", "order is not checked", "a second host's DRIVE is applied"),
    *("voltage is a period late", "the voltage is not held", "limited is never said", "the limit is doubled"),
    *("the slew limit is ignored", "no watchdog", "the watchdog is 3 ms late", "the watchdog is 3 ms early"),
    *("ttl_ms is ignored", "refused DRIVEs feed the watchdog", "HELLO feeds the watchdog", "no travel limit"),
    *("FAULT is said once", "arm leads out of FAULT"),
)


@pytest.mark.parametrize("error", IN_STATES)
def test_the_traces_find_an_error_in_the_states(error: str) -> None:
    assert found_by(SEEDS[error][0])


class Changed(Motion):
    """An encoder whose limits are a little wrong."""

    speed_factor = 1.0
    travel_more = 0
    jumps = 3

    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        while len(self._jumps) > self.jumps:
            self._jumps.popleft()
        farther = [(origin, limit + self.travel_more) for origin, limit in travel_limits]
        built, session = (int(limit * self.speed_factor) for limit in speed_limits)
        yield from super().limits(jump, (built, session), farther)


class Slack(Changed):
    speed_factor = 1.04


class Tight(Changed):
    speed_factor = 0.96


class Farther(Changed):
    travel_more = 1


class NoMedian(Motion):
    def _moved(self, periods: int) -> int:
        return self._counts[-1] - self._counts[-1 - periods]


class NoMedianOfTravel(Motion):
    def _travelled(self) -> int:
        return self._counts[-1]


class WithoutTwice(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        for code, detail in super().limits(jump, speed_limits, travel_limits):
            seen = zip((self._periods, self._long), speed_limits, strict=True)
            moved = [(abs(self._moved(periods)) - 1, periods, limit) for periods, limit in seen]
            if code != 5 or any(m > limit * p * self._period_us * 1e-6 for m, p, limit in moved):
                yield code, detail


class ShortWindows(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        for code, detail in super().limits(jump, speed_limits, travel_limits):
            spans = [(more, more * self._periods) for more in (1, 2)]
            moved = [(abs(self._moved(periods)) - more, periods) for more, periods in spans]
            if code != 5 or any(m > speed_limits[0] * p * self._period_us * 1e-6 for m, p in moved):
                yield code, detail


class ShortBySession(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        yield from super().limits(jump, (speed_limits[1], speed_limits[1]), travel_limits)


class LongByBoard(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        yield from super().limits(jump, (speed_limits[0], speed_limits[0]), travel_limits)


class NoOrigin(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        limit = min(limit for _, limit in travel_limits)
        yield from super().limits(jump, speed_limits, [(-1, limit)])


class OriginOnly(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        yield from super().limits(jump, speed_limits, travel_limits[:1])


class NoMedianFromTheOrigin(Motion):
    def _from(self, origin: int) -> int:
        return ((self.raw or 0) - origin + 2**23) % 2**24 - 2**23


class NoRepair(Motion):
    def latch(self, counts: int, tick: int, built_speed: int) -> int:
        before = list(self._counts)
        jump = super().latch(counts, tick, built_speed)
        change = (counts - (self._raw_before if self._raw_before is not None else counts)) % 2**24
        change -= 2**24 * (change >= 2**23)
        self._counts[-1] = before[-1] + (0 if jump else change)
        self._raw_before = counts
        return jump

    _raw_before: int | None = None


class JumpsAreSpeed(Motion):
    def latch(self, counts: int, tick: int, built_speed: int) -> int:
        return super().latch(counts, tick, 1000 * built_speed)


class TwoJumps(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        if jump and len(self._jumps) >= 2 and self._now - self._jumps[-2] < 100:
            yield 7, jump
        yield from super().limits(jump, speed_limits, travel_limits)


class LongMemory(Motion):
    def limits(self, jump: int, speed_limits: Speeds, travel_limits: Limits) -> Iterator[tuple[int, int]]:
        if jump and len(self._jumps) == 3 and self._now - self._jumps[0] < 160:
            yield 7, jump
        yield from super().limits(jump, speed_limits, travel_limits)


class NewOrigin(Motion):
    def armed(self) -> None:
        self._zero = self._travelled()


class SixteenBits(Motion):
    def latch(self, counts: int, tick: int, built_speed: int) -> int:
        return super().latch(counts & 0xFFFF, tick, built_speed)


MOTIONS = (
    *(Slack, Tight, Farther, NoMedian, NoMedianOfTravel, WithoutTwice, NoRepair, JumpsAreSpeed, TwoJumps),
    *(
        LongMemory,
        NewOrigin,
        SixteenBits,
        ShortWindows,
        NoOrigin,
        ShortBySession,
        LongByBoard,
        OriginOnly,
        NoMedianFromTheOrigin,
    ),
)


@pytest.mark.parametrize("motion", MOTIONS, ids=lambda motion: motion.__name__)
def test_the_traces_find_an_error_in_the_limits(motion: type[Motion]) -> None:
    class Device(ReferenceDevice):
        def __post_init__(self) -> None:
            super().__post_init__()
            self._motion = motion(self.period_us)

    assert found_by(Device)


IN_CORE = (
    ("core/dcmp_encoder.c", "greater(lesser(a, b), lesser(greater(a, b), c))", "lesser(a, lesser(b, c))"),
    ("core/dcmp_encoder.h", "DCMP_JUMP_LIMIT 3u", "DCMP_JUMP_LIMIT 4u"),
    ("core/dcmp_watchdog.c", "> watchdog->time_us", "> watchdog->time_us + 1000u"),
)


@pytest.mark.parametrize("error", IN_CORE, ids=[old for _, old, _ in IN_CORE])
def test_the_traces_find_an_error_in_the_core(
    error: tuple[str, str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, old, new = error
    root = tmp_path / "firmware"
    shutil.copytree(build.sources(), root)
    text = (root / file).read_text()
    assert text.count(old) == 1
    (root / file).write_text(text.replace(old, new))
    monkeypatch.setattr(build, "_SOURCE_FOLDERS", (root,))
    monkeypatch.setattr(build, "_COMPILER_FLAGS", ("-std=c11", "-O0"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    hostlib.load.cache_clear()
    try:
        assert found_by(Firmware)
    finally:
        hostlib.load.cache_clear()
