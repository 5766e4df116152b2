"""The loop through real bytes and the firmware's C shows the figures of the plain simulated rig."""

from __future__ import annotations

import numpy as np
import pytest

from dcmp_hil import run
from tests.helpers import STEADY, bench, figures, known

pytestmark = pytest.mark.untraced

BOARD = ("backend.kind=sim-board", "encoder.zero=0")


@pytest.mark.parametrize("carrier", ["cobs", "slcan", "can"])
def test_tracking_through_the_wire_is_that_of_the_simulated_rig(carrier: str) -> None:
    got, plain = figures(*BOARD, f"backend.carrier={carrier}"), figures("sim.voltage_step_mV=1.0")
    assert known(got.tracking_rms_rad) == pytest.approx(known(plain.tracking_rms_rad), rel=0.05)
    assert known(got.tracking_max_rad) < 2.2e-3
    assert known(got.velocity_error_rms_rad_s) == pytest.approx(
        known(plain.velocity_error_rms_rad_s), rel=0.05
    )
    assert known(got.disturbance_error_rms_rad_s2) == pytest.approx(
        known(plain.disturbance_error_rms_rad_s2), rel=0.05
    )
    assert known(got.voltage_tv_V_s) == pytest.approx(known(plain.voltage_tv_V_s), rel=0.02)
    assert known(got.voltage_peak_V) < 6.0


def test_a_run_through_the_wire_repeats_itself_to_the_bit_on_every_carrier() -> None:
    runs = [
        run(bench(*STEADY, *BOARD, f"backend.carrier={carrier}"), duration=3.0, fast=True).columns
        for carrier in ("cobs", "cobs", "slcan", "can")
    ]
    timing = {"period_us", "lateness_us", "compute_us"}
    for name in set(runs[0]) - timing:
        for other in runs[1:]:
            np.testing.assert_array_equal(runs[0][name], other[name], err_msg=name)


def test_default_start_engages_through_the_wire() -> None:
    result = run(bench("backend.kind=sim-board"), duration=8.0, fast=True, window_from=4.0)
    assert known(result.summary.tracking_rms_rad) < 0.28e-3
    assert result.summary.late_periods == 0


def test_result_counts_what_was_lost_on_the_way() -> None:
    result = run(bench("backend.kind=sim-board"), duration=1.0, fast=True)
    assert result.link is not None
    assert (result.link.lost, result.link.stale, result.link.skipped, result.link.corrupt) == (0, 0, 0, 0)
    assert run(bench(), duration=1.0, fast=True).link is None
