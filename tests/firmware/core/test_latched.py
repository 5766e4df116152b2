"""A fault that is latched: what ends it, and when it is said."""

import pytest

from tests.firmware.bench import Bench, Core

IDLE, FAULT = 1, 4


def test_a_fault_is_left_by_an_edge_only(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    bench.drive(arm=0)  # clear = 0, but before the fault
    bench.send("STOP", reason=2)

    def drive(**fields: int) -> int:
        bench.tick()
        assert bench.drive(fields.pop("voltage", 0), **fields)
        return bench.state

    assert drive(arm=0, clear=1) == FAULT
    assert drive(arm=0, clear=0) == FAULT
    assert drive(arm=0, clear=1, voltage=1) == FAULT
    assert drive(arm=0, clear=1, release=0) == IDLE
    assert bench.fault == (0, 0)
    assert drive(arm=0, clear=1) == IDLE


@pytest.mark.parametrize(
    "drives", [[{}] * 5, [{"clear": 1}] * 5, [{"arm": 1}] * 5, [{"arm": 1}, {}, {"arm": 1}]]
)
def test_a_fault_stays_without_an_edge(core: Core, drives: list[dict[str, int]]) -> None:
    """Neither 0 V alone nor a `clear` that was never down ends it."""
    bench = Bench(core)
    bench.go_to(FAULT)
    for fields in drives:
        bench.tick()
        assert bench.drive(**{"arm": 0, **fields})
        assert bench.state == FAULT


def test_every_fault_wants_an_edge_of_its_own(core: Core) -> None:
    bench = Bench(core)
    bench.go_to(FAULT)
    for clear, state in [(0, FAULT), (1, IDLE)]:
        bench.tick()
        bench.drive(arm=0, clear=clear)
        assert bench.state == state
    bench.send("STOP", reason=3)
    bench.tick()
    bench.drive(arm=0, clear=1)
    assert bench.state == FAULT


def test_an_edge_belongs_to_one_session(core: Core) -> None:
    bench = Bench(core)
    bench.go_to(FAULT)
    bench.drive(arm=0)
    bench.tick()
    bench.drive(arm=0, release=1)
    assert bench.state == FAULT
    assert bench.hello(7)["owned"] == 1
    bench.tick()
    assert bench.drive(arm=0, clear=1, session=7)
    assert bench.state == FAULT
    bench.tick()
    assert bench.drive(arm=0, session=7)
    bench.tick()
    assert bench.drive(arm=0, clear=1, session=7)
    assert bench.state == IDLE


def test_fault_is_sent_at_once_and_every_100_ms(core: Core) -> None:
    bench = Bench(core, start=0xFFFF0000)
    bench.run()
    bench.send("STOP", reason=3)
    happened = bench.device.tick % 256
    bench.seen.clear()
    bench.tick(301)
    names = [name for name, _ in bench.seen if name in ("FAULT", "SAMPLE")]
    assert [i for i, name in enumerate(names) if name == "FAULT"] == [0, 101, 202, 303]
    assert {tuple(f.values()) for name, f in bench.seen if name == "FAULT"} == {(3, happened, 3)}
    assert all(f["fault_class"] == 3 and f["state"] == FAULT for name, f in bench.seen if name == "SAMPLE")


def test_a_second_cause_sends_nothing(core: Core) -> None:
    bench = Bench(core)
    bench.run()
    bench.send("STOP", reason=3)
    bench.tick()
    bench.seen.clear()
    bench.send("STOP", reason=4)
    bench.tick(2)
    assert "FAULT" not in dict(bench.seen)


def test_a_second_fault_is_sent_at_once_too(core: Core) -> None:
    bench = Bench(core)
    bench.go_to(FAULT)
    bench.tick(5)
    bench.drive(arm=0)
    bench.tick()
    bench.drive(arm=0, clear=1)
    bench.send("STOP", reason=9)
    bench.seen.clear()
    bench.tick()
    assert bench.seen[0][1]["detail"] == 9


def test_a_fault_that_is_over_is_not_sent_any_more(core: Core) -> None:
    bench = Bench(core)
    bench.go_to(FAULT)
    bench.take()
    bench.advance(1000)
    core.lib.dcmp_device_tick(bench.device, bench.now, 0, core.ffi.NULL)
    bench.drive(arm=0)
    core.lib.dcmp_device_tick(bench.device, bench.now, 0, core.ffi.NULL)
    bench.drive(arm=0, clear=1)
    assert bench.state == IDLE
    core.lib.dcmp_device_tick(bench.device, bench.now, 0, core.ffi.NULL)
    assert [name for name, _ in bench.take()] == ["SAMPLE"]
