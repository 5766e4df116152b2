import pytest

from tests.firmware.bench import Bench, Core


@pytest.mark.parametrize("limit", [1, 10000, 32767])
def test_clamp(core: Core, limit: int) -> None:
    bench = Bench(core, voltage_limit_mV=limit)
    bench.arm()
    for asked in [0, 1, -1, limit, -limit, limit + 1, -limit - 1, 32767, -32768]:
        if -32768 <= asked <= 32767:
            put = max(-limit, min(limit, asked))
            assert bench.drive(asked)
            assert bench.tick() == (put, True)
            assert bench.sample["limited"] == (put != asked)
            bench.drive(asked)
            bench.tick()
            assert bench.sample["voltage_mV"] == put


@pytest.mark.parametrize(("slew", "period"), [(1, 50), (7, 300), (100, 1000), (5000, 1000), (1 << 30, 50)])
def test_slew(core: Core, slew: int, period: int) -> None:
    bench = Bench(core, slew_mV_per_ms=slew, period_us=period)
    bench.arm()
    now = 0
    for asked in [400, -400, 0]:
        for _ in range(120):
            bench.drive(asked)
            got, _ = bench.tick()
            step = slew * period
            now = (
                1000 * asked
                if abs(1000 * asked - now) <= step
                else now + (step if 1000 * asked > now else -step)
            )
            assert got == int(now / 1000)
            assert bench.sample["limited"] == (now != 1000 * asked)


def test_a_slew_goes_on_without_new_commands(core: Core) -> None:
    bench = Bench(core, slew_mV_per_ms=100)
    bench.arm()
    bench.drive(1000)
    assert [bench.tick()[0] for _ in range(4)] == [100, 200, 300, 400]


def test_a_cut_knows_no_slew_and_is_forgotten(core: Core) -> None:
    bench = Bench(core, slew_mV_per_ms=100)
    bench.arm()
    for _ in range(5):
        bench.drive(1000)
        bench.tick()
    bench.drive(1000, arm=0)
    assert bench.output() == (0, False)
    assert bench.tick() == (0, False)
    for _ in range(10):
        bench.drive()
        assert bench.tick()[0] == 0
    bench.drive(1000)
    assert bench.tick() == (100, True)


@pytest.mark.parametrize("state", [1, 2, 4])
def test_outside_run_no_old_command_is_applied(core: Core, state: int) -> None:
    bench = Bench(core)
    bench.go_to(state)
    bench.device.amplifier.target_mV = 9000
    assert bench.tick() == (0, False)


def test_nothing_lingers_from_before_run(core: Core) -> None:
    """A voltage asked for in IDLE is not what RUN begins with."""
    bench = Bench(core)
    bench.hello()
    bench.drive(9000)
    bench.tick()
    for _ in range(10):
        bench.drive()
        bench.tick()
    assert bench.output() == (0, True)
    assert bench.tick() == (0, True)
