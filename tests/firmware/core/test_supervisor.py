"""The table of section 7, cell by cell, through messages; and what each state means for the amplifier."""

from collections.abc import Callable

import pytest

from tests.firmware.bench import Bench, Core

BOOT, IDLE, ARMING, RUN, FAULT = range(5)
STATES = [BOOT, IDLE, ARMING, RUN, FAULT]


def _late_step(bench: Bench) -> None:
    """DRIVE as in arming, but four ticks behind the one before."""
    bench.device.session.seq = (bench.device.tick - 4) % 8192
    bench.drive()


def _limit(bench: Bench) -> None:
    """Two ticks of 42,000 counts/s: the first may be a wrong count."""
    before = bench.state
    bench.counts += 42
    bench.tick()
    assert bench.state == max(before, IDLE)
    bench.counts += 42
    bench.tick()


def _silence(bench: Bench) -> None:
    bench.advance(20001)
    bench.output()


def _link_down(bench: Bench) -> None:
    bench.lib.dcmp_device_link(bench.device, False, bench.now)


# What happens, and the state that follows BOOT, IDLE, ARMING, RUN, FAULT.
EVENTS: dict[str, tuple[Callable[[Bench], object], list[int]]] = {
    "tick": (lambda b: b.tick(), [IDLE, IDLE, ARMING, RUN, FAULT]),
    "arm at 0 V": (lambda b: b.drive(), [BOOT, ARMING, ARMING, RUN, FAULT]),
    "arm with a voltage": (lambda b: b.drive(1), [BOOT, IDLE, IDLE, RUN, FAULT]),
    "arm, too far on": (_late_step, [BOOT, ARMING, IDLE, RUN, FAULT]),
    "neither arm nor clear": (lambda b: b.drive(arm=0), [BOOT, IDLE, IDLE, IDLE, FAULT]),
    "arm and clear, which is refused": (lambda b: b.drive(clear=1), [BOOT, IDLE, ARMING, RUN, FAULT]),
    "clear": (lambda b: b.drive(arm=0, clear=1), [BOOT, IDLE, IDLE, IDLE, FAULT]),
    "release": (lambda b: b.drive(arm=0, release=1), [BOOT, IDLE, IDLE, IDLE, FAULT]),
    "silence": (_silence, [BOOT, IDLE, IDLE, FAULT, FAULT]),
    "link down": (_link_down, [BOOT, IDLE, IDLE, FAULT, FAULT]),
    "over speed": (_limit, [IDLE, IDLE, ARMING, FAULT, FAULT]),
    "corrupt frames": (lambda b: b.corrupt(10), [BOOT, IDLE, ARMING, FAULT, FAULT]),
    "stop": (lambda b: b.send("STOP", reason=1), [BOOT, FAULT, FAULT, FAULT, FAULT]),
}
ANY_STATE_AFTER = [(name, state, after[state]) for name, (_, after) in EVENTS.items() for state in STATES]


@pytest.mark.parametrize(("name", "state", "after"), ANY_STATE_AFTER)
def test_state_and_event(core: Core, name: str, state: int, after: int) -> None:
    bench = Bench(core, boot=state != BOOT)
    bench.go_to(state)
    EVENTS[name][0](bench)
    assert bench.state == after
    assert bench.output() == (0, after == RUN)
    first = {"silence": 1, "link down": 2, "stop": 3, "corrupt frames": 4, "over speed": 5}
    if state == FAULT:
        assert bench.fault[0] == 3
    else:
        assert bench.fault[0] == (first[name] if after == FAULT else 0)


@pytest.mark.parametrize("state", STATES)
def test_the_table_has_no_other_way(core: Core, state: int) -> None:
    """From FAULT only CLEAR leads out, to IDLE; RUN is entered by the tenth DRIVE alone."""
    lib = core.lib
    for event in range(lib.DCMP_EVENTS):
        after = lib.dcmp_supervisor_next(state, event)
        if state == FAULT:
            assert after == (IDLE if event == lib.DCMP_EVENT_CLEAR else FAULT)
        if state == BOOT:
            assert after == (IDLE if event == lib.DCMP_EVENT_TICK else BOOT)
        if after == BOOT:
            assert state == BOOT
        if after == ARMING:
            assert state == ARMING or (
                state == IDLE and event in (lib.DCMP_EVENT_ARM, lib.DCMP_EVENT_ARM_LAST)
            )
        if after == RUN:
            assert state == RUN or (state, event) == (ARMING, lib.DCMP_EVENT_ARM_LAST)
    assert lib.dcmp_supervisor_next(RUN, lib.DCMP_EVENT_ARM_LAST) == RUN
    assert lib.dcmp_supervisor_next(IDLE, lib.DCMP_EVENT_ARM_LAST) == ARMING


def test_ten_drives_arm(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    for count in range(1, 11):
        assert bench.state == (ARMING if count > 1 else IDLE)
        assert bench.drive()
        assert bench.device.supervisor.counted == (count if count < 10 else 0)
        if count < 10:
            bench.tick()
            assert bench.output() == (0, False)
    assert bench.state == RUN
    assert bench.output() == (0, True)


def test_arming_starts_anew_after_a_break(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    for _ in range(9):
        bench.drive()
        bench.tick()
    bench.drive(1)
    assert bench.state == IDLE
    bench.tick()
    for _ in range(9):
        bench.drive()
        bench.tick()
    assert bench.state == ARMING
    bench.drive()
    assert bench.state == RUN


def test_arming_bears_a_step_of_three_ticks_but_not_of_four(core: Core) -> None:
    for step, state in [(3, ARMING), (4, IDLE)]:
        bench = Bench(core)
        bench.hello()
        bench.drive()
        bench.tick(step)
        assert bench.drive()
        assert bench.state == state


@pytest.mark.parametrize("how", ["disarm", "clear", "release", "stop", "link", "corrupt", "silence", "limit"])
def test_zero_at_once(core: Core, how: str) -> None:
    bench = Bench(core)
    bench.run(5000)
    name = {
        "disarm": "neither arm nor clear", "clear": "clear", "link": "link down",
        "corrupt": "corrupt frames", "limit": "over speed",
    }.get(how, how)  # fmt: skip
    EVENTS[name][0](bench)
    assert bench.output() == (0, False)
    bench.tick(2)
    assert bench.sample["voltage_mV"] == 0
    assert bench.output() == (0, False)


def test_release_is_stronger_than_arm(core: Core) -> None:
    """Such a DRIVE is dropped before; were it not, it would not drive."""
    supervisor = core.new("struct dcmp_supervisor *", {"state": RUN})
    core.lib.dcmp_supervisor_drive(
        supervisor, core.new("struct dcmp_drive *", {"arm": 1, "release": 1}), True
    )
    assert supervisor.state == IDLE


def test_the_first_cause_stays(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    bench.send("STOP", reason=3)
    tick = bench.device.supervisor.fault.tick
    _link_down(bench)
    bench.corrupt(20)
    bench.send("STOP", reason=1)
    _limit(bench)
    _silence(bench)
    assert bench.fault == (3, 3)
    assert bench.device.supervisor.fault.tick == tick


def test_silence_is_found_before_what_the_board_says(core: Core) -> None:
    """Corrupt frames, a failure, a link that goes down: each looks at the time first."""
    for after in (
        lambda bench: bench.corrupt(),
        lambda bench: core.lib.dcmp_device_fail(bench.device, 9, 0, bench.now),
        _link_down,
    ):
        bench = Bench(core)
        bench.run()
        bench.drive(5000)
        bench.corrupt(9)
        bench.advance(20001)
        after(bench)
        assert bench.fault == (1, 20001)


def test_link_that_is_down_has_no_detail(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    _link_down(bench)
    assert bench.fault == (2, 0)


def test_nothing_arms_while_the_link_is_down(core: Core) -> None:
    bench = Bench(core)
    bench.hello()
    bench.lib.dcmp_device_link(bench.device, False, bench.now)
    for _ in range(30):
        bench.drive()
        bench.tick()
        assert bench.state in (IDLE, ARMING)
    bench.lib.dcmp_device_link(bench.device, True, bench.now)
    bench.hello()
    for _ in range(10):
        bench.drive()
        bench.tick()
    assert bench.state == RUN
