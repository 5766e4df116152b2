"""The contract of a backend for samples that are lost, doubled, late, damaged or missing."""

from __future__ import annotations

from contextlib import nullcontext
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import SampleTimeoutError
from dcmp_hil.values import Fault
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Stop
from tests.contract.benches import IN_PROCESS, PUMPED, on_bench
from tests.contract.driving import T, at_rest, drive, wired
from tests.contract.hooks import Doubler, Dropper, Flipper, Swapper, on_way_down

if TYPE_CHECKING:
    from tests.contract.benches import Bench
    from tests.contract.hooks import Chunk


@wired
def test_lost_samples_show_as_a_larger_step_and_are_counted(kind: str) -> None:
    dropper = Dropper()
    with on_bench(kind) as bench, bench.device() as backend:
        drive(backend, 0.5, 10)
        on_way_down(bench, dropper)
        before = backend.read().t
        bench.hurry(0.05)
        dropper.count = 4
        backend.write(0.5)
        after = backend.read()
        assert after.t - before == pytest.approx(5 * T)
        assert backend.counters.lost == 4
        assert after.voltage == 0.5
        assert after.fault == Fault.NONE


@wired
def test_samples_that_come_twice_count_once(kind: str) -> None:
    with on_bench(kind) as bench, bench.device() as backend:
        on_way_down(bench, Doubler())
        times = [sample.t for sample in drive(backend, 0.5, 50)]
        assert times == pytest.approx([T * k for k in range(50)], abs=1e-12)
        assert backend.counters.stale >= 48


@wired
def test_samples_out_of_order_never_turn_time_back(kind: str) -> None:
    with on_bench(kind) as bench, bench.device() as backend:
        bench.hurry(0.05)
        on_way_down(bench, Swapper())
        times = [sample.t for sample in drive(backend, 0.5, 100)]
        assert all(later > earlier for earlier, later in pairwise(times))
        assert backend.counters.stale >= 5
        assert backend.counters.lost >= 5


@wired
def test_damaged_samples_are_dropped_and_ridden_through(kind: str) -> None:
    with on_bench(kind) as bench, bench.device() as backend:
        bench.hurry(0.05)
        on_way_down(bench, Flipper())
        samples = drive(backend, 0.5, 200)
        assert all(abs(sample.position) < 0.5 for sample in samples)
        assert {sample.fault for sample in samples} == {Fault.NONE}
        assert backend.counters.lost >= 15


@pytest.mark.untraced
@wired
@pytest.mark.parametrize(
    "of_board",
    [
        {"count_offset": 2**15 - 5},
        {"count_offset": 2**23 - 5},
        {"count_offset": 2**24 - 5},
        {"count_offset": 2**31 - 5},
        {"start_us": 0xFFFF_0000},
        {"start_us": 2**32 - 5_000},
        {"first_tick": 2**13 - 20},
        {"first_tick": 2**31 - 20},
        {"first_tick": 2**32 - 20},
    ],
    ids=str,
)
def test_nothing_is_seen_of_a_counter_that_wraps(kind: str, of_board: dict[str, int]) -> None:
    with on_bench(kind, **of_board) as bench, bench.make() as backend:
        samples = drive(backend, 2.0, 60) + drive(backend, -2.0, 120)
    steps = [later.position - earlier.position for earlier, later in pairwise(samples)]
    assert max(map(abs, steps)) < 0.01
    assert [sample.t for sample in samples] == pytest.approx([T * k for k in range(180)], abs=1e-12)
    assert {sample.fault for sample in samples} == {Fault.NONE}


@wired
def test_stop_from_any_host_trips_with_its_code(kind: str) -> None:
    with on_bench(kind) as bench, bench.device() as backend:
        drive(backend, 1.0, 5)
        bench.board.receive_frame(*pack(Stop(3)))
        faults = [sample.fault for sample in drive(backend, 1.0, 3)]
        assert faults[-1] == Fault.STOPPED
        assert at_rest(bench)


@wired
def test_host_that_falls_silent_finds_the_amplifier_off(kind: str) -> None:
    with on_bench(kind) as bench, bench.device() as backend:
        driven = drive(backend, 1.0, 5)[-1].t
        bench.hurry()
        samples = [backend.read() for _ in range(40)]
        assert {sample.fault for sample in samples} <= {Fault.NONE, Fault.HOST_SILENT}
        assert samples[-1].fault == Fault.HOST_SILENT
        # a busy computer reads the newest of several samples: the change lies between two that were read
        before = max((sample.t for sample in samples if sample.fault == Fault.NONE), default=driven)
        after = min(sample.t for sample in samples if sample.fault == Fault.HOST_SILENT)
        assert before < after
        assert before - driven < 22.5e-3
        assert after - driven > 18.5e-3
        assert at_rest(bench)


@pytest.mark.parametrize("kind", PUMPED)
def test_device_that_falls_silent_is_an_error_with_a_remedy(kind: str) -> None:
    with on_bench(kind) as bench, pytest.raises(SampleTimeoutError, match="cable"):
        fall_silent(bench)


def fall_silent(bench: Bench) -> None:
    """Drive a device that says nothing any more after a while."""
    with bench.device() as backend:
        drive(backend, 1.0, 5)
        assert bench.pump is not None
        bench.pump.silent.set()
        drive(backend, 1.0, 5)


@pytest.mark.parametrize("kind", IN_PROCESS)
@pytest.mark.parametrize("lost", [9, 1000])
def test_nine_lost_samples_are_ridden_through_and_twenty_are_the_end(kind: str, lost: int) -> None:
    with on_bench(kind) as bench:
        ends = pytest.raises(SampleTimeoutError, match="20 ms") if lost > 20 else nullcontext()
        with ends:
            lose(bench, lost)
        assert at_rest(bench)


def lose(bench: Bench, count: int) -> None:
    """Drive over a gap in the samples."""
    dropper = Dropper()
    with bench.device() as backend:
        on_way_down(bench, dropper)
        drive(backend, 1.0, 5)
        dropper.count = count
        assert drive(backend, 1.0, 1)[0].fault == Fault.NONE


@wired
def test_reset_of_the_device_is_seen_at_once(kind: str) -> None:
    with on_bench(kind) as bench, bench.device() as backend:
        drive(backend, 1.0, 50)
        bench.board.reset()
        samples = drive(backend, 1.0, 3)
        assert samples[-1].fault == Fault.DISARMED
        assert all(later.t > earlier.t for earlier, later in pairwise(samples))
        assert at_rest(bench)


class Flood:
    """Sends the same chunk over and over: a peer that babbles."""

    on = False

    def __call__(self, chunk: Chunk) -> Chunk:
        return chunk * 200 if self.on else chunk


@wired
def test_a_peer_that_floods_holds_nothing_up(kind: str) -> None:
    with on_bench(kind) as bench, bench.device() as backend:
        flood = Flood()
        on_way_down(bench, flood)
        drive(backend, 0.5, 5)
        flood.on = True
        times = [sample.t for sample in drive(backend, 0.5, 5)]
        flood.on = False
        assert all(later > earlier for earlier, later in pairwise(times))
