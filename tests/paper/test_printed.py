"""The printed variants: what they change, and that they change nothing else."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dcmp_hil import load_rig, run
from dcmp_hil.control.controllers import ControllerContext
from dcmp_hil.control.controllers.pd_compensated import PdCompensated
from dcmp_hil.control.model import Model
from dcmp_hil.control.observers import ObserverContext
from dcmp_hil.control.observers.paper import PaperObserver
from dcmp_hil.paper.printed import PrintedEq8, PrintedEq9, PrintedEq10
from dcmp_hil.paper.reproduction import VARIANTS
from dcmp_hil.values import Estimate, Reference, Sample

MODEL = Model()
SETTING = ObserverContext(MODEL, 1e-4, None)
RATE, SWING, VOLTAGE = 0.7, 3.0, 0.8  # rad/s, rad/s2, V
PHASES = [0.0, 0.5, 1.3, 2.2, 3.9, 5.1]


def outputs(kind: type[PaperObserver], phase: float) -> tuple[Estimate, float, float]:
    """Put exact e, e', e'' into an observer at z = 0; return its estimate, x2 and w.

    w = SWING sin(phase), and x1 swings at RATE; x2' = -f0 x2 + w + u gives x2', and eq. (6) at z = 0 gives
    e' = x2 - z2 - L1 e and e'' = x2' - (u + L2 e) - L1 e'.
    """
    w, u = SWING * math.sin(phase), MODEL.ku * VOLTAGE
    x1, x2 = 0.4 * math.cos(phase), -0.4 * RATE * math.sin(phase)
    observer = kind(SETTING, from_zero=True)
    observer.update(Sample(0.0, x1, 0.0))
    e = x1
    e1 = x2 - observer.L1 * e
    e2 = (-MODEL.f0 * x2 + w + u) - (u + observer.L2 * e) - observer.L1 * e1
    observer.v1, observer.v2, observer.v3 = e, e1, e2
    return observer.update(Sample(1e-18, x1, VOLTAGE)), x2, w  # a step of no length: only the outputs


@pytest.mark.parametrize("phase", PHASES)
def test_corrected_outputs_are_exact_when_the_differentiator_is(phase: float) -> None:
    estimate, x2, w = outputs(PaperObserver, phase)
    assert estimate.velocity == pytest.approx(x2, abs=1e-9)
    assert estimate.disturbance == pytest.approx(w, abs=1e-9)


@pytest.mark.parametrize("phase", PHASES)
def test_printed_eq9_is_wrong_by_what_it_lacks(phase: float) -> None:
    estimate, x2, w = outputs(PrintedEq9, phase)
    e1 = x2 - 4.9 * 0.4 * math.cos(phase)
    lacking = 4.9 * e1 + MODEL.f0 * 4.9 * 0.4 * math.cos(phase)
    assert estimate.velocity == pytest.approx(x2, abs=1e-9)
    assert w - estimate.disturbance == pytest.approx(lacking, abs=1e-9)
    assert abs(lacking) > 0.01


def test_printed_eq8_differs_where_v2_is_not_zero_only() -> None:
    literal, meant = PrintedEq8(SETTING), PaperObserver(SETTING)
    for observer in (literal, meant):
        observer.update(Sample(0.0, 0.1, 0.0))
        observer.v1, observer.v3 = 0.01, 2.0
    assert literal.update(Sample(1e-4, 0.1, 1.0)) == meant.update(Sample(1e-4, 0.1, 1.0))
    for observer in (literal, meant):
        observer.v1, observer.v2, observer.v3 = 0.01, 5.0, 2.0
    assert literal.update(Sample(2e-4, 0.1, 1.0)) != meant.update(Sample(2e-4, 0.1, 1.0))


def test_printed_eq10_divides_once_more() -> None:
    setting = ControllerContext(MODEL, 1e-4)
    reference, estimate = Reference(0.1, 0.2, 0.3), Estimate(-0.4, 0.5, 6.0)
    meant = PdCompensated(setting, kp=3000.0, kd=100.0).update(reference, estimate)
    printed = PrintedEq10(setting, kp=3000.0, kd=100.0).update(reference, estimate)
    assert printed == pytest.approx(meant / 5.4, rel=1e-14)


def test_controller_of_your_own_gets_the_position_it_asks_for() -> None:
    own = "controller.kind=dcmp_hil.control.controllers.pd_compensated:PdCompensated"
    shipped = run(load_rig("paper"), duration=0.05, fast=True)
    same = run(load_rig("paper", [own]), duration=0.05, fast=True)  # position = "measured" stays
    other = run(load_rig("paper", [own, "controller.position=estimated"]), duration=0.05, fast=True)
    np.testing.assert_array_equal(same.columns["voltage_sent_V"], shipped.columns["voltage_sent_V"])
    assert shipped.columns["voltage_sent_V"][0] == pytest.approx(1175.0, abs=0.1)
    assert other.columns["voltage_sent_V"][0] == pytest.approx(12.04, abs=0.01)


@pytest.mark.parametrize("name", VARIANTS)
def test_variant_changes_its_own_table_only(name: str) -> None:
    shipped, variant = load_rig("paper"), load_rig("paper", VARIANTS[name])
    changed = {
        table for table in type(shipped).model_fields if getattr(shipped, table) != getattr(variant, table)
    }
    assert changed == {"controller" if name == "eq10" else "observer"}
