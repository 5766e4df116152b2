"""Scenarios of arming, commands, silence, STOP and the link."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tools.traces.steps import OTHER_SESSION, OUR_SESSION

if TYPE_CHECKING:
    from tools.traces.steps import Recorder


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
    host.drive(1800, session=OTHER_SESSION)
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
        host.drive(2000, session=OTHER_SESSION)
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
    host.hello(OTHER_SESSION)
    host.drive(arm=False, clear=True, session=OTHER_SESSION)
    host.tick()
    host.drive(arm=False, session=OTHER_SESSION)
    host.tick(times=100)
    host.drive(arm=False, clear=True, session=OTHER_SESSION)
    host.tick()
    host.drive(session=OUR_SESSION)
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
