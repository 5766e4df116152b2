"""Phase portrait, link counters and thinned lines: what is drawn is what was measured."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.control.model import Model
from dcmp_hil.telemetry.block import Block
from dcmp_hil.telemetry.link_events import DEVICE_COUNTERS, HOST_COUNTERS, LinkWatch, in_order
from dcmp_hil.telemetry.rerun.decimation import peaks, rows_per_bucket, single
from dcmp_hil.telemetry.rerun.phase_portrait import Portrait, round_up
from dcmp_hil.telemetry.signals import columns
from dcmp_hil.values import Event, EventKind, LinkData
from dcmp_hil.wire.link_diagnosis import LinkCounters
from dcmp_hil.wire.messages import Health
from tests.telemetry.runs import blocks


@pytest.mark.parametrize(
    ("value", "end"),
    [(1.0, 1.0), (1.04, 1.0), (1.06, 2.0), (0.3, 0.5), (5.3, 10.0), (9.9, 10.0), (0.02, 0.02)],
)
def test_axes_end_at_round_numbers(value: float, end: float) -> None:
    assert round_up(value) == pytest.approx(end)


def test_portrait_draws_five_times_a_second_and_forgets_after_ten() -> None:
    portrait, times = Portrait(), []
    for block in blocks(13_000):
        portrait.add(block)
        if (found := portrait.draw()) is not None:
            times.append(found[0])
    assert len(times) == pytest.approx(5 * 13, abs=1)
    assert np.diff(times) == pytest.approx(0.2, abs=0.11)
    assert portrait.points[0, 0] == pytest.approx(3.0, abs=0.1)
    assert len(portrait.points) <= 501
    newest = portrait.points[-1]
    assert newest[1:] == pytest.approx(
        [np.sin(newest[0]) + 5e-4, np.cos(newest[0]) - 1e-3, np.sin(newest[0]), np.cos(newest[0])]
    )


def test_portrait_draws_axes_again_only_when_they_grow() -> None:
    portrait = Portrait()
    entities = []
    for block in blocks(4000):
        portrait.add(block)
        entities += [entity for entity, _ in (portrait.draw() or (0.0, []))[1]]
    assert entities.count("portrait/axes") < 6
    assert entities.count("portrait/estimate") > 15


def test_portrait_of_nothing_is_nothing() -> None:
    portrait = Portrait()
    (block,) = blocks(10)
    portrait.add(Block(np.full_like(block.rows, np.nan)))
    assert portrait.draw() is None


# -------------------------------------------------------------------------------------------- thinned lines


@pytest.mark.parametrize(("period", "rows"), [(1e-3, 1), (5e-4, 1), (2e-4, 5), (1e-4, 10)])
def test_slow_lines_are_drawn_as_they_are(period: float, rows: int) -> None:
    assert rows_per_bucket(period) == rows


@given(st.integers(1, 73), st.integers(2, 12), st.integers(0, 10_000))
def test_every_peak_survives_thinning(n: int, rows: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=(n, 3))
    t = 1e-4 * np.arange(n, dtype=np.float64)
    times, drawn = peaks(t, values, rows)
    assert len(times) == len(drawn) == 2 * -(-n // rows)
    assert (np.diff(times) >= 0.0).all()
    assert times[-1] <= t[-1]
    for first in range(0, n, rows):
        bucket, shown = values[first : first + rows], drawn[2 * first // rows : 2 * first // rows + 2]
        assert (shown.max(axis=0) == bucket.max(axis=0)).all()
        assert (shown.min(axis=0) == bucket.min(axis=0)).all()


def test_thinning_keeps_the_order_of_peaks_and_ignores_nan() -> None:
    values = np.array([[1.0, np.nan], [5.0, np.nan], [-5.0, 2.0], [0.0, 1.0]])
    _, drawn = peaks(np.arange(4.0), values, 4)
    assert drawn.tolist() == [[5.0, 2.0], [-5.0, 1.0]]
    _, nothing = peaks(np.arange(4.0), np.full((4, 1), np.nan), 4)
    assert np.isnan(nothing).all()


# --------------------------------------------------------------------------------------------------- link


def _counters(event: Event) -> dict[str, float]:
    assert isinstance(event.data, LinkData)
    return dict(zip((*HOST_COUNTERS, *DEVICE_COUNTERS), in_order(event.data.counters), strict=True))


def test_link_is_told_of_once_a_second_and_only_where_there_is_one() -> None:
    told: list[Event] = []
    backend = SimpleNamespace(counters=LinkCounters(lost=3, corrupt=1), health=None)
    watch = LinkWatch(backend, 1000, told.append)
    for k in range(2500):
        watch.look(1e-3 * k)
    assert [event.t for event in told] == pytest.approx([0.999, 1.999])
    assert {event.kind for event in told} == {EventKind.LINK}
    counts = _counters(told[0])
    assert list(counts) == [*HOST_COUNTERS, *DEVICE_COUNTERS]
    assert (counts["lost"], counts["corrupt"]) == (3.0, 1.0)
    assert np.isnan(counts["crc_errors"])
    backend.health = Health._make([0] * len(Health._fields))._replace(crc_errors=7, late_ticks=2)
    for k in range(1000):
        watch.look(3.0 + 1e-3 * k)
    assert _counters(told[-1])["crc_errors"] == 7.0
    LinkWatch(object(), 1, told.append).look(0.0)
    assert len(told) == 3


# -------------------------------------------------------------------------------- what the disturbance is


def test_disturbance_is_gravity_and_friction_by_the_model_and_a_rest() -> None:
    (block,) = blocks(100)
    table = columns(Block(block.rows, Model(gravity=10.0, f1=2.0)))
    x, v = table["position_estimate_rad"], table["velocity_estimate_rad_s"]
    assert table["gravity_rad_s2"] == pytest.approx(-10.0 * np.sin(x))
    assert table["friction_rad_s2"] == pytest.approx(-2.0 * np.sign(v))
    whole = table["gravity_rad_s2"] + table["friction_rad_s2"] + table["unexplained_rad_s2"]
    assert whole == pytest.approx(table["disturbance_estimate_rad_s2"])
    assert np.isnan(columns(Block(block.rows))["gravity_rad_s2"]).all()


def test_singles_are_the_nearest_and_too_large_ones_stay_finite() -> None:
    values = np.array([[0.1, -1e300], [np.nan, np.inf]])
    drawn = single(values)
    assert drawn[0, 0] == np.float64(np.float32(0.1))
    assert drawn[0, 1] == -float(np.finfo(np.float32).max)
    assert np.isnan(drawn[1, 0])
    assert np.isfinite(drawn[1, 1])
