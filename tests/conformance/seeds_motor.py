"""Errors that need a motor to be seen: section 8."""
# ruff: noqa: SLF001 - an error is sown by overriding what the device does inside

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tests.conformance.seed import Seed
from tests.conformance.seeds_drives import drive_seed
from tests.contract import reference_wire as wire
from tests.contract.reference_motion import Motion
from tests.contract.reference_wire import RUN

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from tests.conformance.seed import Row


class OnePeriodLate(Seed):
    late_mV = 0

    def _apply(self) -> bool:
        wanted, self._wanted_mV = self._wanted_mV, self.late_mV
        limited = super()._apply()
        self.late_mV = self._wanted_mV = wanted
        return limited


class NotHeld(Seed):
    def _apply(self) -> bool:
        if not self._fed:
            self._wanted_mV = 0
        return super()._apply()


class ClampUnsaid(Seed):
    def _apply(self) -> bool:
        super()._apply()
        return False


class ClampTwice(Seed):
    def _apply(self) -> bool:
        self._set[wire.VOLTAGE_LIMIT] *= 2
        try:
            return super()._apply()
        finally:
            self._set[wire.VOLTAGE_LIMIT] //= 2


class NoSlew(Seed):
    def _apply(self) -> bool:
        slew, self._set[wire.SLEW] = self._set[wire.SLEW], 0
        try:
            return super()._apply()
        finally:
            self._set[wire.SLEW] = slew


def silence_seed(change: Callable[[Any, int], int]) -> type[Seed]:
    """Return a device whose watchdog takes another time: (device, age in us)."""

    class Silence(Seed):
        def _silent_us(self) -> int:
            age = self.now_us - self._drive_us
            return age if change(self, age) > 1000 * min(self._set[wire.WATCHDOG], self._ttl_ms) else 0

    return Silence


def _without_ttl(device: Any, age: int) -> int:
    return (
        age
        if device._ttl_ms > device._set[wire.WATCHDOG]
        else age - 1000 * (device._set[wire.WATCHDOG] - device._ttl_ms)
    )


def _without_parameter(device: Any, age: int) -> int:
    return age if device._ttl_ms < 50 else age - 1000 * (20 - min(device._set[wire.WATCHDOG], 20))


class MissedCountsNothing(Seed):
    def tick(self, counts: int) -> None:
        gaps = self._gaps
        super().tick(counts)
        self._gaps = gaps


class FedByRefused(Seed):
    def _on_drive(self, content: bytes) -> None:
        self._drive_us = self.now_us
        super()._on_drive(content)


class FedByHello(Seed):
    def _on_hello(self, content: bytes) -> None:
        self._drive_us = self.now_us
        super()._on_hello(content)


class CorruptIsFine(Seed):
    def _trip(self, code: int, detail: int) -> None:
        if code != wire.CORRUPT_LINK:
            super()._trip(code, detail)


class TwoCorruptEnd(Seed):
    def _corrupt(self) -> None:
        super()._corrupt()
        if self.state == RUN and sum(self._recent) >= 2:
            self._trip(wire.CORRUPT_LINK, sum(self._recent))


class NoTravelLimit(Seed):
    def _trip(self, code: int, detail: int) -> None:
        if code != wire.OVER_TRAVEL:
            super()._trip(code, detail)


class NoSpeedLimit(Seed):
    def _trip(self, code: int, detail: int) -> None:
        if code != wire.OVER_SPEED:
            super()._trip(code, detail)


def speed_seed(windows: Callable[[Motion], Sequence[int]], more: int = 0) -> type[Seed]:
    """Return a device that takes speed over other periods than it should, or lets more counts pass."""

    class Speed(Motion):
        def limits(
            self, jump: int, speed_limits: tuple[int, int], travel_limits: Sequence[tuple[int, int]]
        ) -> Iterator[tuple[int, int]]:
            for code, detail in super().limits(jump, speed_limits, travel_limits):
                seen = (abs(self._moved(periods)) - 1 - more > 0 for periods in windows(self))
                if code != wire.OVER_SPEED or any(seen):
                    yield code, detail

    class Device(Seed):
        def sow(self) -> None:
            self._motion = Speed(self.period_us)

    return Device


class ShorterWindow(Seed):
    def sow(self) -> None:
        self._motion._long //= 2


class OriginIgnored(Seed):
    def _travel_limits(self) -> list[tuple[int, int]]:
        return [(-1, self._set[wire.TRAVEL_LIMIT])]


class OriginWithTheBuiltLimit(Seed):
    def _travel_limits(self) -> list[tuple[int, int]]:
        return [(self._set[wire.TRAVEL_ORIGIN], self.travel_limit_counts)]


class OriginMirrored(Seed):
    def _travel_limits(self) -> list[tuple[int, int]]:
        return [
            (-origin % 2**24 if origin > 0 else origin, limit) for origin, limit in super()._travel_limits()
        ]


SEEDS: dict[str, Row] = {
    "voltage is a period late": (OnePeriodLate, "can", "voltage"),
    "the voltage's sign is lost": (
        drive_seed(lambda _, v, w, s, t: (abs(v), w, s, t)), "can", "voltage",
    ),
    "the voltage is not held": (NotHeld, "can", "voltage-held"),
    "missed periods count as nothing": (MissedCountsNothing, "can", "voltage-held"),
    "limited is never said": (ClampUnsaid, "can", "voltage-limit"),
    "the limit is doubled": (ClampTwice, "can", "voltage-limit"),
    "the slew limit is ignored": (NoSlew, "can", "slew"),
    "no watchdog": (silence_seed(lambda _, __: 0), "can", "watchdog"),
    "the watchdog is 3 ms late": (silence_seed(lambda _, age: age - 3000), "can", "watchdog"),
    "the watchdog is 3 ms early": (silence_seed(lambda _, age: age + 3000), "can", "watchdog"),
    "ttl_ms is ignored": (silence_seed(_without_ttl), "can", "watchdog"),
    "WATCHDOG_MS is ignored": (silence_seed(_without_parameter), "can", "watchdog"),
    "refused DRIVEs feed the watchdog": (FedByRefused, "can", "watchdog-fed"),
    "HELLO feeds the watchdog": (FedByHello, "can", "watchdog-fed"),
    "corrupt frames never end RUN": (CorruptIsFine, "can", "corrupt-link"),
    "two corrupt frames end RUN": (TwoCorruptEnd, "can", "corrupt-link"),
    "no speed limit": (NoSpeedLimit, "can", "speed-limit"),
    "a session's speed limit over 1 ms only": (speed_seed(lambda m: (m._periods,)), "can", "speed-limit"),
    "a session's speed limit over 2 ms only": (speed_seed(lambda m: (2 * m._periods,)), "can", "speed-limit"),
    "speed over 4 ms instead of 8": (ShorterWindow, "can", "speed-limit"),
    "a count too many over 8 ms": (speed_seed(lambda m: (m._long,), more=1), "can", "speed-limit"),
    "the origin of travel is ignored": (OriginIgnored, "can", "travel-origin"),
    "about the origin the built limit holds": (OriginWithTheBuiltLimit, "can", "travel-origin"),
    "the origin of travel is mirrored": (OriginMirrored, "can", "travel-origin"),
    "no travel limit": (NoTravelLimit, "can", "travel-limit"),
}  # fmt: skip
