"""A run from rig to result: its length, its window, its start, and its sinks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import load_rig, run
from dcmp_hil.errors import ConfigError
from dcmp_hil.session import Session
from tests.helpers import STEADY, T, bench, known
from tests.stages import texts_of

if TYPE_CHECKING:
    from dcmp_hil.telemetry.block import Block
    from dcmp_hil.values import Event


@pytest.mark.parametrize(
    ("rate", "duration", "periods"),
    [
        (1000, 0.001, 1),
        (1000, 0.002, 2),
        (1000, 1.0, 1000),
        (1000, 3.013, 3013),
        (3000, 0.5, 1500),
        (10_000, 0.7, 7000),
        (300, 10.0, 3000),
    ],
)
def test_run_has_exactly_the_periods_of_its_duration(rate: int, duration: float, periods: int) -> None:
    result = run(bench(f"loop.rate_hz={rate}"), duration=duration, fast=True)
    assert result.summary.periods == periods
    t = result.columns["time_s"]
    np.testing.assert_allclose(t, np.arange(periods) / rate, rtol=1e-12, atol=0)
    assert {len(column) for column in result.columns.values()} == {periods}


def test_run_takes_the_rigs_duration_when_none_is_given() -> None:
    assert run(bench("run.duration_s=0.25"), fast=True).summary.periods == 250


def test_run_counts_its_figures_from_the_windows_start() -> None:
    whole = run(bench(*STEADY), duration=2.0, fast=True)
    late = run(bench(*STEADY), duration=2.0, fast=True, window_from=0.5)
    assert late.summary.periods == 1500
    assert late.summary.window_s == pytest.approx((0.5, 2.0))
    error = late.columns["tracking_error_mrad"]
    assert len(error) == 2000
    rms = float(np.sqrt(np.mean(error[500:] ** 2)))
    assert late.summary.tracking_rms_rad == pytest.approx(1e-3 * rms, rel=1e-9)
    assert whole.summary.periods == 2000


@pytest.mark.parametrize("overrides", [(), STEADY, ("sim.encoder_noise_counts=0.7", "sim.seed=3")])
def test_run_repeats_to_the_bit(overrides: tuple[str, ...]) -> None:
    one, other = (run(bench(*overrides), duration=5.0, fast=True) for _ in range(2))
    assert one.columns.keys() == other.columns.keys()
    for name, column in one.columns.items():
        assert column.tobytes() == other.columns[name].tobytes(), name
    assert one.events == other.events


def test_run_differs_by_seed_when_there_is_noise() -> None:
    noisy = [
        run(bench("sim.encoder_noise_counts=0.7", f"sim.seed={seed}"), duration=1.0, fast=True).columns
        for seed in (3, 4)
    ]
    assert (noisy[0]["position_rad"] != noisy[1]["position_rad"]).any()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((-1.0, 0.0), "duration"),
        ((math.nan, 0.0), "duration"),
        ((math.inf, 0.0), "duration"),
        ((0.0, 0.0), "duration"),  # until Ctrl-C, in virtual time
        ((1.0, 1.0), "from"),
        ((1.0, -0.1), "from"),
        ((1.0, math.nan), "from"),
    ],
)
def test_run_refuses_times_that_make_no_sense(arguments: tuple[float, float], says: str) -> None:
    duration, window_from = arguments
    with pytest.raises(ConfigError, match=says):
        run(bench(), fast=True, duration=duration, window_from=window_from)


def test_run_keeps_no_columns_when_told_so() -> None:
    session = Session(bench(*STEADY), duration=0.5, fast=True, keep_columns=False)
    session.run()
    result = session.result()
    assert result.columns == {}
    assert result.events == ()
    assert result.summary.periods == 500
    assert (
        result.summary.voltage_peak_V == run(bench(*STEADY), duration=0.5, fast=True).summary.voltage_peak_V
    )


def test_run_on_the_walls_clock_delivers_every_period() -> None:
    result = run(bench(), duration=0.03)
    assert result.summary.periods == len(result.columns["time_s"]) == 30
    assert result.dropped == 0
    assert texts_of(result)[-1] == "amplifier at 0 V"


# ---------------------------------------------------------------- the start


def test_run_settles_then_engages_then_runs() -> None:
    # 0.25 s each (safety.md, "Start of a run"): 0 V, then a growing limit, then all of it
    rig = bench("supervisor.probe=off", "sim.position_rad=0.02", "sim.plant.eta_rad_s2=0.5")
    result = run(rig, duration=4.0, fast=True)
    phases = [(event.t, event.text) for event in result.events if event.kind == "phase"]
    assert [text for _, text in phases] == ["settling", "engaging", "running"]
    assert [t for t, _ in phases] == pytest.approx([0.0, 0.25, 0.5], abs=1e-9)
    t, sent = result.columns["time_s"], result.columns["voltage_sent_V"]
    settling, engaging = t < 0.2495, (t > 0.2495) & (t < 0.4995)
    assert (sent[settling] == 0.0).all()
    assert (np.abs(sent[engaging]) <= 10.0 * (t[engaging] - 0.25) / 0.25 + 1e-9).all()
    assert np.abs(sent[t > 0.5]).max() > 0.1


def test_run_probes_before_it_settles() -> None:
    # 0.1 s at 0 V, +1 V and -1 V for at most 0.1 s each (safety.md, "Start of a run")
    result = run(bench(), duration=2.0, fast=True)
    phases = [(event.t, event.text) for event in result.events if event.kind == "phase"]
    assert [text for _, text in phases] == ["probing", "settling", "engaging", "running"]
    assert [t for t, _ in phases] == pytest.approx([0.0, 0.3, 0.55, 0.8], abs=3e-3)
    t, sent = result.columns["time_s"], result.columns["voltage_sent_V"]
    assert set(sent[t < 0.0995]) == {0.0}
    assert set(sent[(t > 0.1005) & (t < 0.1995)]) == {1.0}
    assert set(sent[(t > 0.2025) & (t < 0.2995)]) == {-1.0}
    assert set(sent[(t > 0.3025) & (t < 0.5495)]) == {0.0}
    assert np.abs(result.columns["position_true_rad"][t < 0.6]).max() < 0.1


def test_run_starts_the_trajectorys_clock_with_engaging() -> None:
    result = run(bench("supervisor.probe=off", "sim.position_rad=0.02"), duration=6.0, fast=True)
    t, reference = result.columns["time_s"], result.columns["position_reference_rad"]
    late = t > 2.251  # after the soft start of 2 s
    np.testing.assert_allclose(reference[late], np.sin(0.5 * (t[late] - 0.25)), rtol=0, atol=1e-12)
    # in the period after the first of ENGAGING the reference is still at x0 = x1_hat
    k = int(np.flatnonzero(t > 0.2495)[0])
    assert reference[k + 1] == pytest.approx(result.columns["position_estimate_rad"][k], abs=1e-7)
    assert result.columns["position_estimate_rad"][k] == pytest.approx(0.02, abs=2e-3)


# ---------------------------------------------------------------- sinks


class _Sink:
    def __init__(self, fails_at: int = 10**9) -> None:
        self.blocks = self.events = self.closed = 0
        self._fails_at = fails_at

    def block(self, block: Block) -> None:
        self.blocks += 1
        assert len(block) > 0
        if self.blocks == self._fails_at:
            raise OSError("disk full")

    def event(self, event: Event) -> None:  # noqa: ARG002
        self.events += 1

    def close(self) -> None:
        self.closed += 1


def test_run_tells_its_sinks_and_closes_them() -> None:
    sink = _Sink()
    run(bench(*STEADY), duration=10.0, fast=True, sinks=[sink])
    assert sink.blocks == 10  # a second each
    assert sink.events >= 4
    assert sink.closed == 1


@pytest.mark.parametrize(("duration", "fails_at"), [(10.0, 1), (10.0, 3), (0.1, 1)])
def test_run_goes_on_when_a_sink_raises(duration: float, fails_at: int) -> None:
    bad, good = _Sink(fails_at), _Sink()
    result = run(bench(*STEADY), duration=duration, fast=True, sinks=[bad, good])
    assert result.summary.periods == round(duration / T)
    assert bad.blocks == fails_at
    assert bad.closed == 0
    assert good.closed == 1
    warnings = [event.text for event in result.events if event.level == "WARN"]
    assert len(warnings) == 1
    assert "disk full" in warnings[0]


def test_reference_is_where_the_arm_is_when_it_settles() -> None:
    columns = run(load_rig("bench-1khz", ["sim.position_rad=0.1"]), duration=0.2, fast=True).columns
    assert columns["position_reference_rad"] == pytest.approx(columns["position_reference_rad"][0])
    assert columns["position_reference_rad"][0] == pytest.approx(0.1, abs=1e-3)


def test_probe_is_no_tracking_error() -> None:
    result = run(bench(), duration=1.5, fast=True)
    t, error = result.columns["time_s"], result.columns["tracking_error_mrad"]
    assert np.isnan(error[t < 0.545]).all()
    assert not np.isnan(error[t > 0.555]).any()
    assert known(result.summary.tracking_max_rad) < 0.02


def test_run_without_a_soft_start_has_a_start_like_any_other() -> None:
    result = run(bench("reference.soft_start_s=0.0", "reference.kind=hold"), duration=1.0, fast=True)
    assert result.summary.periods == 1000
