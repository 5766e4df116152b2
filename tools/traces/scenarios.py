"""The scenarios of the traces: what section 8 of docs/protocol.md says, and what of 6 and 7 it needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from dcmp_hil.wire.messages import Parameter
from tools.traces.steps import OURS, THEIRS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tools.traces.steps import Recorder

BUILT = {
    "counts_per_rev": 4096,
    "period_us": 1000,
    "voltage_limit_mV": 10_000,
    "slew_mV_per_ms": 0,
    "watchdog_ms": 20,
    "speed_limit_counts_s": 32_768,
    "travel_limit_counts": 16_384,
}
"""What the device is built with, unless a scenario says otherwise."""


class Scenario(NamedTuple):
    """A trace to be.

    Parameters
    ----------
    shows
        In a sentence.
    play
        What the host and the encoder do.
    built
        What differs from BUILT.
    """

    shows: str
    play: Callable[[Recorder], None]
    built: Mapping[str, int] = {}


def arming(host: Recorder) -> None:
    """Ten DRIVEs, voltages, a clamp, and the end."""
    host.arm()
    host.run(2, 2500)
    host.run(2, -12_000)
    host.run(2, 0)
    host.drive(3000)
    host.tick()
    host.drive(3000, arm=False)
    host.tick(times=2)


def arming_gap(host: Recorder) -> None:
    """Three periods between two DRIVEs go on, four do not; a voltage ends it, silence too."""
    host.tick()
    host.hello()
    for gap in (3, 4):
        host.drive()
        host.tick(times=gap)
        host.drive()
        host.tick()
        host.drive(arm=False)
        host.tick()
    host.drive()
    host.tick()
    host.drive(1)
    host.tick()
    host.drive(ttl_ms=5)
    host.tick(times=7)


def gap(host: Recorder) -> None:
    """Periods without a DRIVE, and DRIVEs that are too old, repeated, turned round or of another session."""
    host.arm()
    host.run(3, 1000)
    host.tick(times=3)
    host.drive(2000, back=4)
    host.tick()
    host.drive(2000, back=3)
    host.tick()
    host.drive(-2000, back=3)
    host.drive(-2000, back=-1)
    host.tick()
    host.drive(1500)
    host.drive(1600)
    host.drive(1700, back=1)
    host.drive(1800, session=THEIRS)
    host.tick()
    host.drive(1900, ttl_ms=4)
    host.drive(1900, clear=True)
    host.tick(times=2)
    host.run(2, 500)
    host.tick(times=90)  # HEALTH comes, and the watchdog


def watchdog(host: Recorder) -> None:
    """Silence: 0 V above 20 ms, at the tick or between two; ttl_ms shortens it."""
    host.arm()
    host.run(3, 2000)
    for _ in range(23):  # none of these is an accepted DRIVE
        host.tick()
        host.drive(2000, back=30)
        host.drive(2000, session=THEIRS)
        host.hello()
    host.drive(arm=False)
    host.tick()
    host.drive(arm=False, clear=True)
    host.tick()
    host.rearm()
    host.wait(100)
    host.drive(2000, ttl_ms=7)
    host.tick(times=6)
    host.wait(900)
    host.wait(101)
    host.tick(times=2)


def wrong_count(host: Recorder) -> None:
    """One wrong count of any size shows nowhere but in SAMPLE; two in a row do."""
    host.arm()
    host.run(5, 500, moved=30)
    for wrong, after in ((40, 4), (-99, 4), (140, 100), (9000, 100), (-(2**23), 4)):  # two jumps are no fault
        host.run(1, 500, moved=30 + wrong)
        host.run(1, 500, moved=30 - wrong)
        host.run(after, 500, moved=30)
    host.run(1, 500, moved=30 + 68)
    host.run(1, 500, moved=30)
    host.run(2, 500, moved=30 - 68)


def jumps(host: Recorder) -> None:
    """Jumps that stay: the third within 100 periods, the first of them over."""
    host.arm()
    host.run(3, 500, moved=33)
    for jump, after in ((5000, 99), (-7000, 49), (133, 48), (-4000, 1)):
        host.run(1, 500, moved=jump)
        host.run(after, 500)


def over_speed(host: Recorder) -> None:
    """At the limit and one count above; above it is found one tick later."""
    host.arm()
    for moved in (33, 33, 33, 32, 33, 33, 33, 32, 33, 33):
        host.run(1, 2000, moved=moved)
    host.run(1, 2000, moved=34)
    host.run(3, 2000, moved=-33)
    host.run(6, 2000, moved=-34)


def over_speed_slow(host: Recorder) -> None:
    """So far in a tick that it may be a wrong count; a count more, and it is too far for one on the way."""
    host.arm()
    for moved in (67, 0, 0, 0, 68, 0, 0):
        host.run(1, 1000, moved=moved)


def over_travel(host: Recorder) -> None:
    """From the first arming on; a wrong count is no travel, a second arming no new origin."""
    host.tick(7, times=6)
    host.hello()
    host.rearm()
    host.run(9, 1000, moved=30)
    host.run(1, 1000, moved=60)
    host.run(1, 1000, moved=-60)
    host.drive(arm=False)
    host.tick()
    host.rearm()
    host.run(1, 1000, moved=30)
    host.run(1, 1000, moved=1)
    host.run(2, 1000)


def over_speed_low(host: Recorder) -> None:
    """Below a speed limit that a session lowered to a count in 1 ms; then a count too many in 8 ms."""
    host.tick()
    host.hello()
    host.put(Parameter.SPEED_LIMIT_COUNTS_S, 1000)
    host.rearm()
    for moved in (0, 1, 1, 1, 1, 1, 1, 1, 2, 1, 1, 1, 1, 1, 1, 1, 0):
        host.run(1, 500, moved=moved)
    for moved in (3, -2, 3, -2, 12, -12):  # a tremble, and what is no jump for the board
        host.run(1, 500, moved=moved)
    for moved in (2, 1, 1, 1, 2, 1, 1, 1, 2, 1):
        host.run(1, 500, moved=-moved)


def travel_origin(host: Recorder) -> None:
    """Turn about an origin that is not where the device was armed, over the count's wrap."""
    host.counts = 2**24 - 90
    host.tick()
    host.hello()
    host.put(Parameter.TRAVEL_ORIGIN_COUNTS, 30)
    host.put(Parameter.TRAVEL_LIMIT_COUNTS, 150)
    host.rearm()
    host.run(2, 500, moved=-15)
    host.run(8, 500, moved=30)
    host.run(1, 500, moved=50)
    host.run(1, 500, moved=-50)
    host.run(2, 500, moved=30)
    host.run(1, 500, moved=1)
    host.run(2, 500)


def travel_built(host: Recorder) -> None:
    """Give an origin on the way: what the board was built with stands, from the first arming on."""
    host.tick()
    host.hello()
    host.put(Parameter.TRAVEL_ORIGIN_COUNTS, 200)
    host.rearm()
    host.run(10, 500, moved=30)
    host.run(1, 500, moved=1)
    host.run(2, 500)


def limits_end(host: Recorder) -> None:
    """Limits of a session end with it: the next one may do what this one may not."""
    host.tick()
    host.hello()
    host.put(Parameter.VOLTAGE_LIMIT_MV, 1000)
    host.put(Parameter.SLEW_MV_PER_MS, 600)
    host.put(Parameter.SPEED_LIMIT_COUNTS_S, 1000)
    host.put(Parameter.TRAVEL_LIMIT_COUNTS, 20)
    host.put(Parameter.TRAVEL_ORIGIN_COUNTS, 3)
    host.rearm()
    host.run(4, 2500, moved=1)
    host.drive(arm=False, release=True)
    host.tick()
    host.hello(THEIRS)
    for _ in range(10):
        host.drive(session=THEIRS)
        host.tick()
    for _ in range(4):
        host.drive(2500, session=THEIRS)
        host.tick(30)


def wrap(host: Recorder) -> None:
    """Turn the count over 2^24 and back: nothing is seen of it."""
    host.counts = 2**24 - 40
    host.arm()
    host.run(4, 1000, moved=20)
    host.run(4, -1000, moved=-25)
    host.drive(arm=False)
    host.tick()


def stop_and_clear(host: Recorder) -> None:
    """STOP, the first cause stays, and every way that does not clear it, then the one that does."""
    host.arm()
    host.run(2, 3000)
    host.stop(3)
    host.tick()
    host.stop(1)
    host.drive(arm=False, clear=True)
    host.tick()
    host.drive(3000)
    host.tick()
    host.drive(1, arm=False, clear=True)
    host.tick()
    host.drive(arm=False, clear=True)
    host.tick()
    host.rearm()
    host.run(2, 3000)
    host.drive(3000, arm=False, clear=True)
    host.tick()
    host.stop(0)
    host.drive(arm=False, clear=True)
    host.tick()
    host.drive(arm=False)
    host.tick()
    host.drive(arm=False, release=True)
    host.tick()
    host.hello(THEIRS)
    host.drive(arm=False, clear=True, session=THEIRS)
    host.tick()
    host.drive(arm=False, session=THEIRS)
    host.tick(times=100)
    host.drive(arm=False, clear=True, session=THEIRS)
    host.tick()
    host.drive(session=OURS)
    host.tick()


def line_down(host: Recorder) -> None:
    """Hang the line up in RUN, and in ARMING."""
    host.arm()
    host.run(2, 3000)
    host.line(up=False)
    host.tick(times=2)
    host.line(up=True)
    host.tick()
    host.drive(arm=False)
    host.tick()
    host.drive(arm=False, clear=True)
    host.tick()
    host.drive()
    host.tick()
    host.line(up=False)
    host.tick()
    host.line(up=True)
    host.tick()


def corrupt_link(host: Recorder) -> None:
    """Nine corrupt frames among the last 100, a hundred good ones, then ten."""
    host.arm()
    host.run(2, 1000)
    for _ in range(9):
        host.drive(spoilt=True)
    host.run(92, 1000)
    for _ in range(10):
        host.drive(spoilt=True)
    host.tick()


def slew(host: Recorder) -> None:
    """Follow commands under a slew limit, also without a new one; disarming knows none."""
    host.arm()
    host.run(3, 500)
    host.tick(times=3)
    host.run(3, -200)
    host.drive(-12_000)
    host.tick(times=2)
    host.drive(arm=False)
    host.tick()


def short_period(host: Recorder) -> None:
    """Turn at 32 counts in 1 ms, four periods, then at 36."""
    host.arm()
    host.run(6, 500, moved=8)
    host.run(8, 500, moved=9)


SCENARIOS: dict[str, Scenario] = {
    "arming": Scenario("Ten DRIVEs lead to RUN; a clamp; 0 V at once at the end.", arming),
    "arming-gap": Scenario("Arming that is broken by a gap, a voltage, silence.", arming_gap),
    "gap": Scenario(
        "RUN without DRIVEs: the voltage is held; old, repeated and foreign ones are refused.", gap
    ),
    "watchdog": Scenario(
        "Silence in RUN: FAULT(HOST_SILENT) at a tick, and between two by ttl_ms.", watchdog
    ),
    "wrong-count": Scenario("One wrong count of any size is repaired; two are speed.", wrong_count),
    "jumps": Scenario("The third jump within 100 periods is ENCODER_JUMP.", jumps),
    "over-speed": Scenario("One count a period above the limit is OVER_SPEED, a tick later.", over_speed),
    "over-speed-2ms": Scenario("A speed that only twice the time shows.", over_speed_slow),
    "over-travel": Scenario(
        "Travel from the first arming on, over a second one.", over_travel, {"travel_limit_counts": 300}
    ),
    "over-speed-8ms": Scenario(
        "A speed limit of a session, too low for 1 and 2 ms: 8 ms show it.", over_speed_low
    ),
    "travel-origin": Scenario("Travel from an origin that a session gave.", travel_origin),
    "travel-built": Scenario(
        "For any origin of the session, the board's own limit counts from the first arming.",
        travel_built,
        {"travel_limit_counts": 300},
    ),
    "limits-end": Scenario("Limits of a session end with it.", limits_end),
    "wrap": Scenario("The count passes 2^24.", wrap),
    "stop-and-clear": Scenario("STOP; what clears a fault, and what does not.", stop_and_clear),
    "line-down": Scenario("The line hangs up in RUN and in ARMING.", line_down),
    "corrupt-link": Scenario("Ten corrupt frames among the last 100.", corrupt_link),
    "slew": Scenario("A slew limit of 150 mV/ms.", slew, {"slew_mV_per_ms": 150}),
    "period-250us": Scenario(
        "One count too many at a period of 250 us: speed is over four periods.",
        short_period,
        {"period_us": 250},
    ),
}
