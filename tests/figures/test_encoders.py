"""Encoders from 64 to 65,536 counts: a healthy run ends well, or the rig is refused before anything moves."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig
from dcmp_hil.config.explain import warnings
from dcmp_hil.control.observers.super_twisting import bandwidth_floor, watch_floor
from dcmp_hil.errors import ConfigError
from tests import helpers
from tests.figures.detection import detect
from tools.encoders import healthy

if TYPE_CHECKING:
    from tests.helpers import FaultySim

pytestmark = pytest.mark.untraced


@pytest.mark.parametrize("counts", [256, 360, 400, 500, 1000, 2500, 8192, 65_536])
def test_healthy_run_ends_well_with_any_encoder(counts: int) -> None:
    assert healthy(counts, 1000, seeds=3, duration=6.0) == {"well": 3}


@pytest.mark.parametrize(("counts", "rate"), [(256, 200), (300, 5000), (5000, 200), (16_384, 3000)])
def test_healthy_run_ends_well_at_any_rate(counts: int, rate: int) -> None:
    assert healthy(counts, rate, seeds=1, duration=6.0) == {"well": 1}


@pytest.mark.parametrize("counts", [16, 64, 100, 255])
def test_encoder_too_coarse_to_find_a_fault_in_time_is_refused(counts: int) -> None:
    override = f"encoder.counts_per_rev={counts}"
    with pytest.raises(ConfigError, match=r"encoder\.counts_per_rev.*below 256.*600 ms"):
        load_rig("bench-1khz", [override])
    load_rig("bench-1khz", [override, "supervisor.monitors=finite"])  # a simulation without the watch


def test_check_says_where_the_probe_cannot_tell() -> None:
    (sentence,) = warnings(load_rig("bench-1khz", ["encoder.counts_per_rev=300"]))
    assert "too coarse for the probe" in sentence
    assert warnings(load_rig("bench-1khz", ["encoder.counts_per_rev=600"])) == []


def test_watch_follows_the_tuning_rule_and_is_as_it_was_at_4096_counts() -> None:
    assert watch_floor(4096.0, 1e-3) == 100.0
    assert watch_floor(65_536.0, 1e-3) == watch_floor(None, 1e-3) == 100.0
    assert watch_floor(256.0, 1e-3) == pytest.approx(2.5 * bandwidth_floor(256.0, 1e-3))
    assert watch_floor(4096.0, 1e-2) == pytest.approx(30.0)  # 0.3 / T


@pytest.mark.parametrize(
    ("counts", "backend", "typical", "longest"),
    [  # s, docs/safety.md; measured 196 and 354, 164 and 349, 119 and 223, 118 and 266 ms
        (256, helpers.StuckEncoder, 0.250, 0.600),
        (256, helpers.LostPower, 0.200, 0.600),
        (1024, helpers.StuckEncoder, 0.150, 0.300),
        (1024, helpers.LostPower, 0.150, 0.350),
    ],
)
def test_fault_is_found_in_the_time_that_the_safety_page_says(
    counts: int, backend: type[FaultySim], typical: float, longest: float
) -> None:
    times = [each.time for each in detect(backend, f"encoder.counts_per_rev={counts}", seeds=6)]
    assert median(times) <= typical
    assert max(times) <= longest


@pytest.mark.parametrize(("counts", "longest", "speed"), [(256, 0.300, 4.5), (1024, 0.300, 3.5)])
def test_reversal_is_found_in_the_time_that_the_safety_page_says(
    counts: int, longest: float, speed: float
) -> None:
    found = detect(helpers.Reversed, f"encoder.counts_per_rev={counts}", seeds=6)
    assert max(each.tripped_at - each.fault_at for each in found) <= longest
    assert max(each.speed for each in found) <= speed
