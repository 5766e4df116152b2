"""The ring between the loop and telemetry."""

from __future__ import annotations

import mmap
import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.ipc.ring import FIELDS, Ring, size_of
from dcmp_hil.values import Truth
from tests.helpers import cycle

if TYPE_CHECKING:
    from pathlib import Path

TRUTH = Truth(7.0, 8.0, 9.0)


def push(ring: Ring, first: int, last: int) -> None:
    for k in range(first, last):
        ring.push(cycle(float(k)), TRUTH)


def test_rows_come_out_in_order_and_once() -> None:
    ring = Ring(8)
    push(ring, 0, 5)
    assert len(ring) == 5
    assert ring.drain()[:, 0].tolist() == [0, 1, 2, 3, 4]
    push(ring, 5, 7)
    assert ring.drain()[:, 0].tolist() == [5, 6]
    assert ring.drain().shape == (0, len(FIELDS))
    assert ring.dropped == 0


def test_a_row_holds_every_field_in_order() -> None:
    ring = Ring(2)
    ring.push(cycle(1.5, position=0.25, applied=-3.0, sent=2.0), TRUTH)
    row = dict(zip(FIELDS, ring.drain()[0].tolist(), strict=True))
    assert (row["t"], row["position"], row["voltage_applied"]) == (1.5, 0.25, -3.0)
    assert (row["voltage_sent"], row["period"]) == (2.0, 1e-3)
    assert (row["position_true"], row["velocity_true"], row["disturbance_true"]) == TRUTH


def test_the_oldest_rows_are_dropped_and_counted() -> None:
    ring = Ring(4)
    push(ring, 0, 11)
    assert len(ring) == 11
    assert ring.drain()[:, 0].tolist() == [7, 8, 9, 10]
    assert ring.dropped == 7
    push(ring, 11, 13)
    assert ring.drain()[:, 0].tolist() == [11, 12]
    assert ring.dropped == 7


def test_rows_are_a_copy() -> None:
    ring = Ring(2)
    push(ring, 0, 2)
    rows = ring.drain()
    push(ring, 2, 4)
    assert rows[:, 0].tolist() == [0, 1]


@pytest.mark.parametrize("overtaken", [0, 1, 3, 9])
def test_rows_overwritten_while_they_are_copied_are_left_out_and_counted(
    overtaken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    ring = Ring(4)
    push(ring, 0, 4)
    arange = np.arange

    def slow(first: int, last: int) -> np.ndarray:
        push(ring, 4, 4 + overtaken)
        return arange(first, last)

    with monkeypatch.context() as patch:
        patch.setattr("dcmp_hil.ipc.ring.np.arange", slow)
        rows = ring.drain()
    assert rows[:, 0].tolist() == [0, 1, 2, 3][overtaken:]
    assert ring.dropped == min(overtaken, 4)


_READS = """
import mmap, sys
from dcmp_hil.ipc.ring import Ring
with open(sys.argv[1], "r+b") as file:
    ring = Ring(64, mmap.mmap(file.fileno(), 0))
print("up", flush=True)
last, back = 0, 0
while last < 300_000:
    now = ring.written
    back += now < last
    last = max(last, now)
print(back)
"""


def test_another_process_never_sees_the_count_go_back(tmp_path: Path) -> None:
    """It did: what packs a number clears its place first."""
    (tmp_path / "ring").write_bytes(bytes(size_of(64)))
    with (tmp_path / "ring").open("r+b") as file:
        ring = Ring(64, mmap.mmap(file.fileno(), 0))
    command = [sys.executable, "-c", _READS, str(tmp_path / "ring")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as reader:
        assert reader.stdout is not None
        assert reader.stdout.readline() == "up\n"
        for k in range(300_000):
            ring.push(cycle(1e-3 * k), TRUTH)
        assert reader.communicate(timeout=60.0)[0] == "0\n"
