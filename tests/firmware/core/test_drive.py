"""Which DRIVEs are accepted, and when they act."""

import pytest

from tests.firmware.bench import SESSION, Bench, Core, encode

RUN, FAULT = 3, 4


@pytest.mark.parametrize(
    ("period", "oldest"), [(50, 60), (100, 30), (700, 5), (1000, 3), (2999, 2), (3000, 1), (100000, 1)]
)
def test_age(core: Core, period: int, oldest: int) -> None:
    for age in range(oldest + 20):
        bench = Bench(core, period_us=period)
        bench.hello()
        bench.tick(100)
        bench.hello()
        bench.device.session.owner = 0x1234  # a long period lets the lease lapse
        assert bench.drive(age=age) is (age <= oldest)
        assert bench.drive(age=-1) is False


@pytest.mark.parametrize(
    "held_ms", [*range(13), *range(13, 501, 7), 250, 253, 254, 255, 256, 257, 258, 259, 260, 500]
)
def test_a_drive_that_lay_in_a_buffer(core: Core, held_ms: int) -> None:
    """Up to 3 ms it counts; later it feeds nothing, and 256 ticks later it does not look fresh either."""
    bench = Bench(core)
    bench.run()
    seq = bench.device.tick
    for _ in range(held_ms):
        bench.tick()
        bench.device.watchdog.fed_us = bench.now  # only the order and the age decide here
    bench.device.session.seq = (seq - 1) % 8192
    gaps = bench.device.health.report.sequence_gaps
    assert bench.drive(4000, seq=seq % 8192) is (held_ms <= 3)
    assert bench.device.health.report.sequence_gaps == min(gaps + (held_ms > 3), 255)
    assert bench.tick()[0] == (4000 if held_ms <= 3 else 5000)


def test_it_waits_for_the_answer_to_the_newest_sample(core: Core) -> None:
    bench = Bench(core)

    def waits() -> bool:
        return bool(bench.lib.dcmp_device_waits(bench.device))

    bench.hello()
    bench.tick()
    assert not waits()  # no host has armed it
    assert bench.drive(arm=1, age=1)
    assert waits()  # ARMING, and that was the answer to the one before
    assert bench.drive(arm=1)
    assert not waits()
    bench.tick()
    bench.run()
    assert waits()
    bench.drive()
    assert not waits()
    bench.device.tick = 8191 + 3 * 8192
    bench.device.session.seq = 8190
    assert waits()
    assert bench.drive()
    assert not waits()
    bench.tick()
    assert waits()  # seq begins anew
    assert bench.drive()
    assert not waits()
    bench.tick()
    assert bench.drive(arm=0)
    bench.tick()
    assert not waits()  # IDLE


def test_every_delay_from_4_to_500_ms(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    bench.device.tick = 20000
    for delay in range(4, 8192 - 3):
        assert bench.drive(seq=(bench.device.tick - delay) % 8192) is False
    assert bench.drive(seq=(bench.device.tick + 1) % 8192) is False
    assert bench.drive(age=3) is True


def test_order(core: Core) -> None:
    bench = Bench(core, period_us=50)  # 60 ticks of age to play with
    bench.hello()
    bench.tick(100)
    assert bench.drive(age=50)
    assert not bench.drive(age=50)
    assert not bench.drive(age=51)
    assert bench.drive(age=49)
    assert bench.drive(age=0)
    assert not bench.drive(age=1)


def test_order_reaches_half_way_round(core: Core) -> None:
    for step, fine in [(0, False), (1, True), (4095, True), (4096, False), (8191, False)]:
        bench = Bench(core)
        bench.hello()
        bench.drive()
        bench.device.tick = 5000
        bench.device.session.seq = (5000 - step) % 8192
        assert bench.drive(seq=5000) is fine


def test_the_first_of_a_session_has_no_predecessor(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    assert bench.drive()
    assert not bench.drive()
    assert bench.drive(seq=0) is False
    bench.tick()
    assert bench.drive(arm=0, release=1)
    bench.hello()
    assert bench.drive()


@pytest.mark.parametrize(
    ("ttl", "fine"), [(0, False), (4, False), (5, True), (50, True), (51, False), (255, False)]
)
def test_ttl(core: Core, ttl: int, fine: bool) -> None:
    bench = Bench(core)
    bench.hello()
    assert bench.drive(ttl_ms=ttl) is fine
    assert bench.device.health.report.sequence_gaps == 0


def test_only_the_owners(core: Core) -> None:
    bench = Bench(core)
    assert not bench.drive(session=0)
    bench.hello()
    assert not bench.drive(session=0)
    assert not bench.drive(session=0x1235)
    assert bench.drive()


def test_a_stop_is_no_drive_with_any_bytes_behind_it(core: Core) -> None:
    """A controller's buffer may hold the rest of a longer frame."""
    bench = Bench(core)
    bench.run()
    number, stop = encode("STOP", reason=3)
    newest = {"seq": bench.device.tick, "session": SESSION, "ttl_ms": 50}
    _, drive = encode("DRIVE", voltage_mV=0, arm=1, clear=0, release=0, **newest)
    frame = core.frame(number, stop + drive[2:])
    frame.length = len(stop)
    core.lib.dcmp_device_receive(bench.device, frame, bench.now)
    assert bench.state == FAULT
    assert not bench.device.driven


def test_before_the_first_sample_there_is_nothing_to_answer(core: Core) -> None:
    bench = Bench(core, boot=False)
    bench.hello()
    for seq in (0, 1, 8191, 8190):
        assert not bench.drive(seq=seq)


def test_a_command_acts_from_the_next_tick_and_is_reported_after_it(core: Core) -> None:
    bench = Bench(core)
    bench.arm()
    seen = []
    for voltage in (100, 200, 300, 400):
        assert bench.drive(voltage)
        assert bench.tick() == (voltage, True)
        seen.append(bench.sample["voltage_mV"])
    assert seen == [0, 100, 200, 300]


def test_the_newest_of_a_period_is_applied(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    assert bench.drive(1000, age=2, seq=(bench.device.tick) % 8192) is True
    bench.tick(2)
    assert bench.drive(2000, age=1)
    assert bench.drive(3000, age=0)
    assert not bench.drive(4000, age=1)
    assert bench.tick() == (3000, True)


def test_a_burst_of_held_commands_applies_the_newest_alone(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    first = bench.device.tick
    bench.tick(19)
    for held in range(1, 20):
        assert bench.drive(held, seq=first + held) is (held >= 16)
    assert bench.tick() == (19, True)


def test_missed(core: Core) -> None:
    bench = Bench(core)
    assert bench.sample["missed"] == 1
    bench.arm()
    assert bench.sample["missed"] == 0
    gaps = bench.device.health.report.sequence_gaps
    bench.tick(3)
    assert bench.sample["missed"] == 1
    assert bench.device.health.report.sequence_gaps == gaps + 3
    bench.drive()
    bench.tick()
    assert bench.sample["missed"] == 0
    bench.drive(arm=0)
    bench.tick(3)
    assert bench.sample["missed"] == 1
    assert bench.device.health.report.sequence_gaps == gaps + 3


def test_missed_while_arming(core: Core) -> None:
    bench = Bench(core)
    bench.go_to(2)
    gaps = bench.device.health.report.sequence_gaps
    bench.tick(2)
    assert bench.state == 2
    assert bench.device.health.report.sequence_gaps == gaps + 2


@pytest.mark.parametrize("around", [256, 8192, 1 << 31])
def test_ticks_wrap(core: Core, around: int) -> None:
    bench = Bench(core)
    bench.device.tick = around - 14
    bench.run(1000)
    for _ in range(30):
        assert bench.drive(1000)
        assert bench.tick() == (1000, True)
        assert bench.sample["tick"] == bench.device.tick % 256
        assert bench.ask("PARAMETER_GET", id=4)["value"] == bench.device.tick % (1 << 31)
    assert bench.device.tick > around


def test_the_first_sample(core: Core) -> None:
    bench = Bench(core)
    assert bench.sample.pop("state") == 1
    assert bench.sample.pop("missed") == 1
    assert set(bench.sample.values()) == {0}


@pytest.mark.parametrize("flags", [(1, 1, 0), (1, 0, 1), (0, 1, 1), (1, 1, 1)])
def test_a_drive_whose_flags_contradict_each_other_is_dropped(
    core: Core, flags: tuple[int, int, int]
) -> None:
    arm, clear, release = flags
    bench = Bench(core)
    bench.run()
    bench.tick()
    assert not bench.drive(arm=arm, clear=clear, release=release)
    assert bench.drive()
