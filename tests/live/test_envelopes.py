"""What a page draws of a run: every cycle counts, memory and lines are bounded, the last cycle is there."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil.ipc.ring import FIELDS
from dcmp_hil.live.envelopes import (
    BUCKET_S,
    BUCKETS_PER_LINE_MAX,
    COLUMNS,
    HISTORY_S,
    Bucket,
    BucketHistory,
    Envelopes,
)
from dcmp_hil.live.state import state_of
from tests.helpers import bench

if TYPE_CHECKING:
    from numpy.typing import NDArray

_LINE_BYTES_MAX = 1 << 16  # that a panel reads


def _rows(n: int, *, first: int = 0, period: float = 1e-3, **columns: Any) -> NDArray[np.float64]:
    rows = np.zeros((n, len(FIELDS)))
    rows[:, FIELDS.index("t")] = (first + np.arange(n)) * period
    rows[:, FIELDS.index("began")] = -math.inf
    for name, values in columns.items():
        rows[:, FIELDS.index(name)] = values
    return rows


def _all(envelopes: Envelopes) -> list[Bucket]:
    envelopes.finish()
    return envelopes.history.after(0, 10**6)[1]


def _pair(bucket: Bucket, name: str) -> list[float | None]:
    at = 2 + 2 * COLUMNS.index(name)
    return bucket[at : at + 2]


@pytest.mark.parametrize("block", [1, 7, 100, 1000])
def test_one_cycle_is_the_extreme_of_its_bucket_however_the_rows_come(block: int) -> None:
    rng = np.random.default_rng(block)
    position = rng.normal(size=1000)
    position[517], position[518] = 99.0, -88.0
    rows = _rows(1000, position=position, position_reference=1.0)
    envelopes = Envelopes(bench())
    for start in range(0, 1000, block):
        envelopes.add(rows[start : start + block])
    buckets = _all(envelopes)
    assert len(buckets) == 25
    for k, bucket in enumerate(buckets):
        part = position[40 * k : 40 * k + 40]
        assert _pair(bucket, "position_rad") == pytest.approx([part.min(), part.max()], rel=1e-5)
        assert _pair(bucket, "error_mrad") == pytest.approx(
            [1e3 * (part.min() - 1.0), 1e3 * (part.max() - 1.0)], rel=1e-5
        )
    assert max(_pair(one, "position_rad")[1] or 0.0 for one in buckets) == 99.0


def test_late_cycles_are_counted_in_their_bucket_and_in_all() -> None:
    lateness = np.zeros(1000)
    lateness[[3, 4, 900]] = 0.51e-3  # of a period of 1 ms
    lateness[5] = 0.49e-3
    envelopes = Envelopes(bench())
    envelopes.add(_rows(1000, lateness=lateness))
    assert envelopes.late == 3
    counts = [bucket[1] for bucket in _all(envelopes)]
    assert (counts[0], counts[22], sum(map(float, map(str, counts)))) == (2, 1, 3.0)


def test_the_disturbance_is_split_by_the_model_as_in_the_state() -> None:
    rig = bench()
    values: dict[str, Any] = {
        "position_estimate": 0.5,
        "velocity_estimate": -0.2,
        "disturbance_estimate": 3.0,
    }
    envelopes = Envelopes(rig)
    envelopes.add(_rows(1, **values))
    (bucket,) = _all(envelopes)
    row = dict(zip(FIELDS, _rows(1, **values)[0].tolist(), strict=True))
    state = state_of(row, 4, rig)
    gravity = -rig.model.gravity_rad_s2 * math.sin(0.5)
    expected = {"gravity_rad_s2": gravity, "friction_rad_s2": rig.model.f1_rad_s2}
    expected |= {"rest_rad_s2": 3.0 - gravity - rig.model.f1_rad_s2, "disturbance_rad_s2": 3.0}
    for name, value in expected.items():
        assert state[name] == pytest.approx(value)
        assert _pair(bucket, name) == pytest.approx([value, value], rel=1e-5)


def test_what_is_no_number_is_null_and_the_reference_is_not_drawn_before_it_begins() -> None:
    envelopes = Envelopes(bench())
    envelopes.add(_rows(40, began=math.inf, position=0.5, disturbance_estimate=math.nan))
    envelopes.add(_rows(40, first=40, voltage_applied=[math.inf, *[2.0] * 39]))
    first, second = _all(envelopes)
    for name in ("reference_rad", "error_mrad", "disturbance_rad_s2", "rest_rad_s2"):
        assert _pair(first, name) == [None, None]
    assert _pair(first, "position_rad") == [0.5, 0.5]
    assert _pair(second, "voltage_V") == [2.0, 2.0]
    json.dumps([first, second], allow_nan=False)


@pytest.mark.filterwarnings("error")
def test_absurd_numbers_are_drawn_as_none_without_a_word() -> None:
    envelopes = Envelopes(bench())
    rows = _rows(50, position=1e308, position_reference=-1e308, disturbance_estimate=1.7e308)
    rows[3, FIELDS.index("t")] = math.nan
    rows[7] = math.inf
    envelopes.add(rows)
    envelopes.add(rows[:0])
    json.dumps(_all(envelopes), allow_nan=False)


@pytest.mark.parametrize("rate", [20.0, 1000.0, 10_000.0])
def test_memory_and_lines_are_bounded_at_any_rate(rate: float) -> None:
    rig = bench()
    envelopes, place, taken = Envelopes(rig), 0, 0
    n = round(rate * 0.5)
    rng = np.random.default_rng(1)
    for second in range(120):
        rows = _rows(n, first=second * n, period=1.0 / rate, position=-rng.random(n) * 1e-5)
        rows[:, 4:] = -rows[:, [1]]
        envelopes.add(rows)
        place, buckets = envelopes.history.after(place)
        taken += len(buckets)
    assert taken == pytest.approx(60.0 / max(BUCKET_S, 1.0 / rate), abs=2)
    _, history = envelopes.history.after(0, 10**6)
    assert len(history) <= HISTORY_S / BUCKET_S
    line = json.dumps({"columns": COLUMNS, "buckets": history[:BUCKETS_PER_LINE_MAX]})
    assert len(line) < 0.6 * _LINE_BYTES_MAX


def test_history_is_read_from_any_place_in_pieces_and_survives_what_was_dropped() -> None:
    history = BucketHistory()
    history.add([[float(k)] for k in range(700)])
    place, found = history.after(0, 100)
    assert (place, found[0], found[-1]) == (300, [200.0], [299.0])  # the first 200 are dropped
    place, found = history.after(650, 100)
    assert (place, len(found)) == (700, 50)
    assert history.after(place) == (700, [])
    assert history.newest(0)[0] == [700.0 - BUCKETS_PER_LINE_MAX]
    history.clear()
    assert history.after(0) == (700, [])
    history.add([[1.0]])
    assert history.after(place) == (701, [[1.0]])
