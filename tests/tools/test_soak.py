"""What a soak calls growth: a leak of 0.3 MB a minute, and nothing that comes and goes."""

from __future__ import annotations

import mmap
import os
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tools.soak.memory import Growth, Memory
from tools.soak.result import SoakResult

if TYPE_CHECKING:
    from pathlib import Path

BYTES_PER_MB = 1_000_000


def half_an_hour(leak: float, seed: int) -> Growth:
    """Return memory that warms up for four minutes and leaks (MB a minute), with what waits in queues."""
    chance, growth = np.random.default_rng(seed), Growth()
    for minute in range(30):
        warming_up = min(minute, 4) * 5.0
        growth.add(minute, 60.0 + warming_up + leak * minute + chance.uniform(0.0, 3.0))
    return growth


def soaked(growth: Growth) -> SoakResult:
    memory = Memory()
    memory.growth["telemetry process"] = growth
    return SoakResult(30.0, 60.0, {}, memory, 0, 1_800_000, 1_800_000, 200.0, 400.0, [])


@pytest.mark.parametrize("seed", range(50))
def test_a_leak_is_found_and_nothing_else(seed: int) -> None:
    assert soaked(half_an_hour(0.0, seed)).faults() == []
    fault, *_ = soaked(half_an_hour(0.3, seed)).faults()
    assert fault.startswith("telemetry process: grows by 0.")


@pytest.mark.parametrize(("at", "lost", "later"), [(10, 80.0, 0.0), (24, 100.0, 0.0), (15, 0.0, 1.0)])
def test_memory_that_is_lost_at_once_or_late_is_found(at: int, lost: float, later: float) -> None:
    growth = half_an_hour(0.0, 1)
    growth.mb = [mb + (minute >= at) * (lost + later * (minute - at)) for minute, mb in enumerate(growth.mb)]
    assert any("MB more than 24 simulated minutes before" in fault for fault in soaked(growth).faults())


def test_process_that_ended_early_is_a_fault() -> None:
    growth = half_an_hour(0.0, 1)
    growth.minutes, growth.mb = growth.minutes[:12], growth.mb[:12]
    assert soaked(growth).faults() == ["telemetry process: not seen after minute 11, so it ended early"]


def test_memory_that_was_never_seen_twice_after_the_warm_up_is_a_fault() -> None:
    growth = Growth([0.0, 5.0], [50.0, 50.0])
    assert (
        "telemetry process: no two minutes after the warm-up, so its growth is not known"
        in soaked(growth).faults()
    )


def test_periods_that_are_missing_are_a_fault() -> None:
    short = soaked(half_an_hour(0.0, 0))
    short.recorded -= 1
    assert short.faults() == ["0 periods in no figure, 1 not recorded"]


def test_the_least_of_a_minute_counts() -> None:
    assert Growth([0.1, 0.5, 1.2, 1.9], [7.0, 5.0, 6.0, 8.0]).by_minute() == [5.0, 6.0]


def test_what_a_process_has_for_itself_counts_and_what_it_maps_of_files_does_not(tmp_path: Path) -> None:
    file = tmp_path / "library"
    file.write_bytes(bytes(20 * BYTES_PER_MB))
    memory, me = Memory(), {"me": os.getpid()}
    memory.look(0, me, os.getpid())
    with file.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
        assert sum(mapped[::4096]) == 0
        memory.look(1, me, os.getpid())
        private = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS  # and not malloc, which may have so much to spare
        with mmap.mmap(-1, 20 * BYTES_PER_MB, flags=private) as kept:
            for at in range(0, 20 * BYTES_PER_MB, 4096):
                kept[at] = 1
            memory.look(2, me, os.getpid())
    before, with_file, with_memory = memory.growth["me"].mb
    assert with_file - before < 5.0
    assert with_memory - with_file == pytest.approx(20.0, abs=5.0)


def test_files_in_memory_count_once_and_apart() -> None:
    descriptor = os.memfd_create("ledger")
    try:
        memory = Memory()
        memory.look(0, {}, os.getpid())
        os.write(descriptor, bytes(10 * BYTES_PER_MB))
        other = os.dup(descriptor)
        memory.look(1, {}, os.getpid())
        os.close(other)
    finally:
        os.close(descriptor)
    before, after = memory.growth["shared files"].mb
    assert after - before == pytest.approx(10.0, abs=0.1)


def test_a_process_that_has_ended_is_left_out() -> None:
    memory = Memory()
    memory.look(0, {"gone": 2**22 + 1}, os.getpid())
    assert "gone" not in memory.growth
