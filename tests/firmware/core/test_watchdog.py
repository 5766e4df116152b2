import itertools

import pytest

from tests.firmware.bench import Bench, Core

RUN, FAULT = 3, 4
PERIODS_US = [100, 250, 1000, 1700, 3000]


@pytest.mark.parametrize("period", PERIODS_US)
@pytest.mark.parametrize("start", [0, 0xFFFF0000, 0xFFFFFFFF, 0x7FFFF000])
def test_silence_ends_in_zero_volts(core: Core, period: int, start: int) -> None:
    """After the watchdog's time and at most one tick, for any phase of the host."""
    device = core.new("struct dcmp_device *")
    phases = range(0, period, 50)
    for watchdog, ttl, phase in itertools.product([5, 20, 50], [5, 13, 50], phases):
        config = core.config(period_us=period, watchdog_ms=watchdog)
        bound = 1000 * min(watchdog, ttl)
        last = core.lib.check_drive(device, config, start, phase, ttl, 5000, 3)
        assert device.supervisor.state == RUN
        after = core.lib.check_silence(device, period, last, phase, 100_000)
        assert bound < after <= bound + period
        assert device.supervisor.state == FAULT
        assert (device.supervisor.fault.code, device.supervisor.fault.detail) == (1, after)


@pytest.mark.parametrize("start", [0, 0xFFFFB000])
def test_between_ticks_it_is_exact(core: Core, start: int) -> None:
    bench = Bench(core, start=start)
    bench.run()
    assert bench.drive(5000)
    bench.advance(20000)
    assert bench.output() == (5000, True)
    bench.advance(1)
    assert bench.output() == (0, False)
    assert bench.fault == (1, 20001)


def test_a_drive_that_comes_too_late_does_not_hide_it(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    assert bench.drive(5000)
    bench.advance(20001)
    assert bench.drive(5000, seq=bench.device.tick + 1) is False
    assert bench.state == FAULT
    assert bench.fault == (1, 20001)


def test_other_traffic_feeds_nothing(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    assert bench.drive(5000)
    for _ in range(20):
        bench.tick()
        bench.send("HELLO", session=0x1234, protocol_hash=core.lib.check_protocol_hash())
        bench.send("PARAMETER_GET", id=1)
        bench.send("PARAMETER_SET", session=0x1234, id=9, value=50)
        bench.drive(5000, session=0x4321)
        bench.drive(5000, ttl_ms=51)
        bench.drive(5000, ttl_ms=4)
        bench.drive(5000, age=4)
        assert bench.state == RUN
    bench.tick()
    assert bench.fault == (1, 21000)


def test_nineteen_lost_drives_are_borne(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    for _ in range(3):
        assert bench.drive(5000)
        assert bench.tick(20) == (5000, True)


def test_a_clock_that_steps_back_is_silence(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    bench.advance(-2000)
    assert bench.output() == (0, False)
    assert bench.fault == (1, 0xFFFFFFFF - 999 & 0x7FFFFFFF)


def test_arming_ends_in_idle(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    bench.drive()
    bench.tick(20)
    assert bench.state == 2
    bench.tick()
    assert bench.state == 1
    assert bench.fault == (0, 0)


def test_setting_it_changes_it(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    assert bench.ask("PARAMETER_SET", session=0x1234, id=9, value=7)["result"] == 0
    bench.run()
    bench.drive(5000)
    bench.tick(7)
    assert bench.state == RUN
    bench.tick()
    assert bench.fault == (1, 8000)
