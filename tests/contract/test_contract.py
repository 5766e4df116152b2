"""One contract for every backend: what the loop may rely on, with any device behind read and write."""

from __future__ import annotations

import math
from contextlib import nullcontext

import pytest

from dcmp_hil.errors import LinkError, TripError
from dcmp_hil.values import Fault
from dcmp_hil.wire.messages import State
from tests.contract.benches import IN_PROCESS, on_bench
from tests.contract.driving import ENDINGS, T, at_rest, drive, every, run_into, wired

LIMIT = "amplifier.voltage_limit_V=5.0"


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
