"""The closed loop in single precision: whole cycles of the law in float, on an arm in double."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from dcmp_hil import run
from tests.firmware.core_library import CORE, law_headers
from tests.helpers import bench
from tests.target.build import FIRMWARE
from tests.target.chip_image import closed_loop, here
from tests.target.chip_rigs import FED_FORWARD, RIGS, parameters
from tools.boards import read_boards

if TYPE_CHECKING:
    import ctypes
    from collections.abc import Callable

DURATION, FROM = 30.13, 5.0  # s
PHASES = (0.0, 1.0 / 3.0, 2.0 / 3.0)  # counts
FAST = ("loop.rate_hz=10000", FED_FORWARD)
TRACKING_MAX = 0.08  # mrad, at 10 kHz
APART_MAX = 0.05
DAY_TICKS = 86_400_000


def _rms(errors: Any) -> float:
    """Return in mrad what is given in rad."""
    return 1e3 * float(np.sqrt(np.mean(np.square(errors))))


def _in_single(library: ctypes.CDLL, settings: tuple[str, ...]) -> float:
    told = parameters(settings)
    period = float(told["period"][0])
    loop = closed_loop(library, told, round(DURATION / period))
    assert loop.began * period == pytest.approx(0.55, abs=1e-3)
    return _rms(loop.errors[round(FROM / period) :])


def _in_double(settings: tuple[str, ...]) -> float:
    columns = run(bench(*settings), duration=DURATION, fast=True).columns
    errors = columns["position_true_rad"] - columns["position_reference_rad"]
    return _rms(errors[columns["time_s"] >= FROM])


def _both(library: ctypes.CDLL, settings: tuple[str, ...]) -> Any:
    rigs = [(*settings, f"sim.encoder_phase_counts={phase}") for phase in PHASES]
    return np.array([(_in_single(library, rig), _in_double(rig)) for rig in rigs])


def test_at_1_khz_as_shipped_it_follows_as_in_double(
    library: ctypes.CDLL, figure: Callable[[str], None]
) -> None:
    single, double = _both(library, ()).mean(axis=0)
    figure(f"float loop at 1 kHz: {single:.4f} mrad, in double {double:.4f}")
    assert single == pytest.approx(double, rel=APART_MAX)


def test_at_10_khz_with_known_friction_it_follows_closely(
    library: ctypes.CDLL, figure: Callable[[str], None]
) -> None:
    single, double = _both(library, FAST).mean(axis=0)
    figure(f"float loop at 10 kHz, friction fed forward: {single:.4f} mrad, in double {double:.4f}")
    assert single <= TRACKING_MAX
    assert single == pytest.approx(double, rel=APART_MAX)


def test_a_loop_that_runs_for_a_day_is_that_of_its_first_second(library: ctypes.CDLL) -> None:
    """Seconds in single precision would have lost the sample's period by then; ticks do not."""
    for settings in RIGS:
        loop = closed_loop(library, parameters(settings), 2000)
        later = loop.order.rows.copy()
        later["tick"] += DAY_TICKS
        assert np.array_equal(here(library, loop.order._replace(rows=later)), loop.results)


def test_no_program_of_a_board_has_the_law() -> None:
    """It is tried on its own first; the boards' images and the traces of the wire stay what they were."""
    folders = [FIRMWARE / "app", FIRMWARE / "soc", *(FIRMWARE / "boards" / name for name in read_boards())]
    files = [path for folder in folders for path in folder.rglob("*.[ch]")] + sorted(CORE.glob("*.c"))
    law = {header.name for header in law_headers()} | {"dcmp_real.h"}
    assert len(files) > 60
    assert {"dcmp_control.h", "dcmp_cycle.h"} <= law
    found = {
        path.name for path in files if law & set(re.findall(r'#include "([^"]+)"', path.read_text("utf-8")))
    }
    assert found == set()
