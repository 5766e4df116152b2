"""Eq. (10), corrected."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dcmp_hil.control.controllers import ControllerContext
from dcmp_hil.control.controllers.pd_compensated import PdCompensated, PdSettings
from dcmp_hil.control.model import Model
from dcmp_hil.values import Estimate, Reference

_SETTING = ControllerContext(Model(), 1e-3)
_small = st.floats(-10.0, 10.0)


def test_pd_compensated_asks_for_the_papers_first_voltage() -> None:
    # x = -1.57 at rest, x_r = sin(t/2) at t = 0, w_hat = 0: (4000 x 1.57 + 130 x 0.5)/5.4 = 1175.0 V
    got = PdCompensated(_SETTING).update(Reference(0.0, 0.5, 0.0), Estimate(-1.57, 0.0, 0.0))
    assert got == pytest.approx(1175.0, abs=0.1)  # theory.md, section 2


@given(x=_small, v=_small, w=_small, xr=_small, vr=_small, ar=_small)
def test_pd_compensated_gives_the_error_its_poles(
    x: float, v: float, w: float, xr: float, vr: float, ar: float
) -> None:
    # Put back into x'' = -f0 x' + w + (ku/J) V it must leave e'' + 130 e' + 4000 e = 0.
    voltage = PdCompensated(_SETTING).update(Reference(xr, vr, ar), Estimate(x, v, w))
    acceleration = -0.1 * v + w + 5.4 * voltage
    left = (acceleration - ar) + 130.0 * (v - vr) + 4000.0 * (x - xr)
    assert left == pytest.approx(0.0, abs=1e-9)


def test_pd_leaves_the_disturbance_alone_and_nothing_else() -> None:
    reference, estimate = Reference(0.1, 0.2, 0.3), Estimate(0.11, 0.25, 8.0)
    without = PdSettings(kind="pd").build(_SETTING).update(reference, estimate)
    with_it = PdSettings().build(_SETTING).update(reference, estimate)
    assert without - with_it == pytest.approx(8.0 / 5.4, rel=1e-12)


def test_pd_settings_hand_their_gains_over() -> None:
    got = PdSettings(kp_1_s2=100.0, kd_1_s=7.0).build(_SETTING)
    assert got.update(Reference(0.0, 0.0, 0.0), Estimate(-1.0, 0.0, 0.0)) == pytest.approx(100.0 / 5.4)
    assert got.update(Reference(0.0, 1.0, 0.0), Estimate(0.0, 0.0, 0.0)) == pytest.approx(7.0 / 5.4)
