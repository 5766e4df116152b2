"""Scenarios of the encoder: wrong counts, jumps, speed, travel, and counts that wrap."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dcmp_hil.wire.messages import Parameter
from tools.traces.steps import OTHER_SESSION

if TYPE_CHECKING:
    from tools.traces.steps import Recorder


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
    host.hello(OTHER_SESSION)
    for _ in range(10):
        host.drive(session=OTHER_SESSION)
        host.tick()
    for _ in range(4):
        host.drive(2500, session=OTHER_SESSION)
        host.tick(30)


def wrap(host: Recorder) -> None:
    """Turn the count over 2^24 and back: nothing is seen of it."""
    host.counts = 2**24 - 40
    host.arm()
    host.run(4, 1000, moved=20)
    host.run(4, -1000, moved=-25)
    host.drive(arm=False)
    host.tick()


def short_period(host: Recorder) -> None:
    """Turn at 32 counts in 1 ms, four periods, then at 36."""
    host.arm()
    host.run(6, 500, moved=8)
    host.run(8, 500, moved=9)
