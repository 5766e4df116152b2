"""One contract for every backend: what the loop may rely on, for every kind of read and write."""

from __future__ import annotations

import math
import threading
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import ConfigError, LinkError, OpenError, SampleTimeoutError, TripError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.values import Fault
from dcmp_hil.wire import protocol_hash
from dcmp_hil.wire.codec import pack
from dcmp_hil.wire.messages import Hello, State, Stop
from sim_backend.board.backend import SimBoardBackend
from tests.contract.benches import ALL, IN_PROCESS, PUMPED, WIRED, on_bench
from tests.contract.hooks import Doubler, Dropper, Flipper, Swapper, on_way_down

if TYPE_CHECKING:
    from collections.abc import Iterator

    from dcmp_hil.backend import Backend
    from dcmp_hil.values import Sample
    from tests.contract.benches import Bench
    from tests.contract.hooks import Chunk

T = 1e-3
LIMIT = "amplifier.voltage_limit_V=5.0"
every = pytest.mark.parametrize("kind", ALL)
wired = pytest.mark.parametrize("kind", WIRED)


def drive(backend: Backend, voltage: float, periods: int) -> list[Sample]:
    """Answer samples with a voltage."""
    samples = []
    for _ in range(periods):
        samples.append(backend.read())
        backend.write(voltage)
    return samples


def at_rest(bench: Bench) -> bool:
    """Whether the amplifier is at 0 V, disarmed."""
    return bench.board.applied_mV == 0 and not bench.board.enable


@every
def test_time_starts_at_zero_and_counts_periods(kind: str) -> None:
    with on_bench(kind) as bench, bench.make() as backend:
        samples = drive(backend, 0.0, 300)
    assert [sample.t for sample in samples] == pytest.approx([T * k for k in range(300)], abs=1e-12)
    assert samples[0].position == pytest.approx(0.0, abs=2e-3)
    assert {sample.fault for sample in samples} == {Fault.NONE}


@every
def test_cause_comes_before_effect_by_one_sample(kind: str) -> None:
    with on_bench(kind) as bench, bench.make() as backend:
        drive(backend, 0.0, 5)
        backend.read()
        backend.write(2.0)
        seen = [sample.voltage for sample in drive(backend, 2.0, 4)]
    assert seen == [0.0, 2.0, 2.0, 2.0]


@every
def test_voltage_really_applied_is_echoed_after_the_clamp(kind: str) -> None:
    with on_bench(kind, LIMIT) as bench, bench.make() as backend:
        assert drive(backend, 99.0, 5)[-1].voltage == 5.0
        assert drive(backend, -99.0, 5)[-1].voltage == -5.0
        assert drive(backend, 1.2345, 5)[-1].voltage == pytest.approx(1.2345, abs=1e-3)


@every
def test_positive_voltage_raises_the_arm(kind: str) -> None:
    with on_bench(kind) as bench, bench.make() as backend:
        assert drive(backend, 4.0, 150)[-1].position > 0.05


@every
@pytest.mark.parametrize("signs", [("1", "-1"), ("-1", "1"), ("-1", "-1")])
def test_signs_of_the_wiring_are_undone_on_the_host(kind: str, signs: tuple[str, str]) -> None:
    wiring = (f"encoder.sign={signs[0]}", f"amplifier.sign={signs[1]}")
    with on_bench(kind, *wiring) as bench, bench.make() as backend:
        last = drive(backend, 4.0, 150)[-1]
    assert last.position > 0.05
    assert last.voltage == 4.0


@wired
def test_zero_is_where_the_rig_says(kind: str) -> None:
    with (
        on_bench(kind, "encoder.zero=100", "sim.position_rad=0.1534") as bench,
        bench.make() as backend,
    ):
        assert backend.read().position == pytest.approx(0.1534 - 100 * math.tau / 4096, abs=5e-3)


ENDINGS = [TripError("test", "It happened.", "Mend it."), RuntimeError(), KeyboardInterrupt(), None]


def run_into(backend: Backend, bench: Bench, error: BaseException | None) -> None:
    """Drive for a while, and end as an error does."""
    with backend:
        drive(backend, 3.0, 20)
        assert bench.board.applied_mV == 3000
        if error:
            raise error


@wired
@pytest.mark.parametrize("error", ENDINGS, ids=lambda error: type(error).__name__)
def test_amplifier_is_at_zero_and_disarmed_however_the_run_ends(
    kind: str, error: BaseException | None
) -> None:
    with on_bench(kind) as bench:
        backend = bench.make()
        with pytest.raises(type(error)) if error else nullcontext():
            run_into(backend, bench, error)
        assert at_rest(bench)
        assert (bench.board.state == State.FAULT) == isinstance(error, TripError)
        with pytest.raises(LinkError, match="not open"):
            backend.read()


@wired
def test_device_of_a_trip_is_armed_again_by_the_next_run(kind: str) -> None:
    with on_bench(kind) as bench:
        with pytest.raises(TripError):
            run_into(bench.make(), bench, ENDINGS[0])
        assert bench.board.state == State.FAULT
        run_into(bench.make(), bench, None)
        assert at_rest(bench)


@wired
def test_lost_samples_show_as_a_larger_step_and_are_counted(kind: str) -> None:
    dropper = Dropper()
    with on_bench(kind) as bench, bench.device() as backend:
        drive(backend, 0.5, 10)
        on_way_down(bench, dropper)
        before = backend.read().t
        bench.hurry()
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
        drive(backend, 1.0, 5)
        bench.hurry()
        faults = [backend.read().fault for _ in range(40)]
        assert faults[0] == Fault.NONE
        assert faults[-1] == Fault.HOST_SILENT
        assert 18 <= faults.index(Fault.HOST_SILENT) <= 22
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


def test_second_host_on_a_bus_is_refused_and_changes_nothing() -> None:
    with on_bench("can virtual") as bench, bench.device() as backend:
        drive(backend, 2.0, 5)
        with keep_driving(backend), pytest.raises(OpenError, match="another host") as caught:
            bench.device().__enter__()
        assert "\n" not in str(caught.value)
        assert drive(backend, 2.0, 3)[-1].voltage == 2.0


@pytest.mark.parametrize("kind", ["cobs pty", "slcan pty"])
def test_second_host_on_a_port_is_told_who_has_it(kind: str) -> None:
    with on_bench(kind) as bench, bench.device(), pytest.raises(OpenError, match="busy"):
        bench.make().__enter__()


@wired
def test_host_that_does_not_fit_gives_the_device_back_at_once(kind: str) -> None:
    with on_bench(kind) as bench:
        host = bench.device()
        fitting = host._terms  # noqa: SLF001
        host._terms = replace(fitting, counts_per_rev=2000)  # noqa: SLF001
        with pytest.raises(ConfigError, match="the rig says 2000, the device 4096"):
            host.__enter__()
        host._terms = fitting  # noqa: SLF001
        with host:
            assert drive(host, 1.0, 3)[-1].voltage == 1.0


@wired
def test_other_protocol_is_refused_with_both_versions(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dcmp_hil.device.handshake.PROTOCOL_HASH", 0x12345678)
    monkeypatch.setattr("dcmp_hil.device.open_errors.PROTOCOL_HASH", 0x12345678)
    with on_bench(kind) as bench:
        with pytest.raises(OpenError) as caught:
            bench.make().__enter__()
        assert "12345678" in str(caught.value)
        assert f"{protocol_hash.PROTOCOL_HASH:08x}" in str(caught.value)
        assert at_rest(bench)


@contextmanager
def keep_driving(backend: Backend) -> Iterator[None]:
    """Keep one host alive, in a thread of its own, while another tries."""
    ending = threading.Event()

    def keep() -> None:
        while not ending.is_set():
            drive(backend, 2.0, 1)

    thread = threading.Thread(target=keep)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join(5.0)
        assert not thread.is_alive()


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


@pytest.mark.parametrize("slept", [560, 620, 680, 740])
def test_host_that_slept_does_not_take_another_hosts_run_for_its_own(slept: int) -> None:
    """It is suspended, the device faults, another host takes over: none of it looks like its own run."""
    with on_bench("sim-board can") as bench, ExitStack() as hosts:
        clock = SimulatedClock()
        first = SimBoardBackend(bench.rig, clock, bench.board)
        hosts.enter_context(first)
        drive(first, 1.0, 5)
        for _ in range(slept):  # no host answers: a fault, and the session lapses
            bench.board.tick()
            bench.board.transmit_frames()  # lost: the sleeper's buffer is full
        assert bench.board.owner == 0
        second = hosts.enter_context(SimBoardBackend(bench.rig, SimulatedClock(), bench.board))
        drive(second, 2.0, 50)
        clock.sleep_until_ns(int(1e6 * (slept + 100)))
        with pytest.raises(LinkError, match="stood still") as woken:
            first.read()
        first.write(-5.0)
        first.__exit__(LinkError, woken.value, None)
        drive(second, 2.0, 2)
        assert bench.board.applied_mV == 2000


@wired
def test_an_orderly_end_is_no_gap_in_the_sequence(kind: str) -> None:
    with on_bench(kind) as bench:
        backend = bench.device()
        for _ in range(3):
            run_into(backend, bench, None)
        with backend:
            drive(backend, 0.5, 120)
        assert backend.health is not None
        assert backend.health.sequence_gaps <= (0 if kind in IN_PROCESS else 20)  # a thread may miss some


@pytest.mark.parametrize("kind", IN_PROCESS)
def test_an_error_of_the_link_after_a_command_stops_the_device_at_once(kind: str) -> None:
    with on_bench(kind) as bench:
        backend = bench.device()
        with pytest.raises(LinkError, match="odd"):
            run_into(backend, bench, LinkError("odd"))
        assert at_rest(bench)
        assert bench.board.state == State.FAULT


@pytest.mark.parametrize("kind", IN_PROCESS)
def test_ctrl_c_while_arming_leaves_nothing_armed(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with on_bench(kind) as bench:
        tick = bench.board.tick

        def interrupted() -> None:
            tick()
            if bench.board.state == State.RUN:
                raise KeyboardInterrupt

        monkeypatch.setattr(bench.board, "tick", interrupted)
        with pytest.raises(KeyboardInterrupt):
            bench.make().__enter__()
        assert at_rest(bench)


@pytest.mark.parametrize("kind", ["sim-board can", "stranger can"])
def test_an_identity_that_answers_another_host_is_not_believed(kind: str) -> None:
    """Another host's HELLO comes just before ours: its IDENTITY says owned, and means the other one."""
    with on_bench(kind) as bench:
        receive = bench.board.receive_frame
        meddled: list[int] = []

        def meddle(number: int, data: bytes) -> None:
            if number == 0x060 and not meddled:
                meddled.append(number)
                receive(*pack(Hello(0x4242, protocol_hash.PROTOCOL_HASH)))
            receive(number, data)

        bench.board.receive_frame = meddle  # type: ignore[method-assign]
        with pytest.raises(OpenError, match="another host"):
            bench.make().__enter__()
        assert meddled
        assert at_rest(bench)
