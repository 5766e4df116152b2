"""The paper's own simulation: every row, every misprint, and the command that shows them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from dcmp_hil import load_rig, paper, run
from dcmp_hil.paper import Misprint, Reproduction, Row, as_json, reproduce
from dcmp_hil.paper.measures import damping, settled_from
from dcmp_hil.session import Session
from tests.cli.conftest import Outcome

Cli = Callable[..., Outcome]

KEYS = ["quantity", "claimed", "printed_eq9", "printed_eq10", "corrected", "low", "high", "pass"]


def row(reproduction: Reproduction, quantity: str) -> Row:
    (found,) = (row for row in reproduction.rows if row.quantity == quantity)
    return found


def misprint(reproduction: Reproduction, equation: str, quantity: str) -> Misprint:
    (found,) = (one for one in reproduction.misprints if (one.equation, one.quantity) == (equation, quantity))
    return found


def use(monkeypatch: pytest.MonkeyPatch, reproduction: Reproduction) -> None:
    monkeypatch.setattr(paper, "reproduce", lambda: reproduction)


@pytest.mark.parametrize(
    ("quantity", "low", "high"),
    [
        ("voltage_at_start_V", 1174.9, 1175.1),
        ("tracking_max_rad", 0.0, 3e-5),
        ("tracking_rms_rad", 3.15e-6, 3.85e-6),
        ("velocity_error_max_rad_s", 0.0, 6e-4),
        ("disturbance_error_rms_rad_s2", 0.10, 0.15),
        ("velocity_settled_s", 0.375, 0.415),
        ("voltage_peak_V", 2.55, 2.65),
        ("damping", 1.0275, 1.0285),
    ],
)
def test_reproduction_holds_every_tolerance_of_the_theory(
    reproduction: Reproduction, quantity: str, low: float, high: float
) -> None:
    found = row(reproduction, quantity)
    assert (found.low, found.high) == pytest.approx((low, high))
    assert low <= found.corrected <= high
    assert found.passed


def test_reproduction_gives_the_figures_measured_independently(reproduction: Reproduction) -> None:
    # A plain script without this package, same equations and step.
    assert row(reproduction, "tracking_max_rad").corrected == pytest.approx(1.1006e-5, rel=1e-3)
    assert row(reproduction, "tracking_rms_rad").corrected == pytest.approx(3.461e-6, rel=1e-3)
    assert row(reproduction, "velocity_error_max_rad_s").corrected == pytest.approx(2.844e-4, rel=1e-3)
    assert row(reproduction, "disturbance_error_rms_rad_s2").corrected == pytest.approx(0.1219, rel=1e-3)
    assert row(reproduction, "velocity_settled_s").corrected == pytest.approx(0.3948, abs=2e-4)


@pytest.mark.parametrize(
    ("equation", "quantity", "expected", "rel"),
    [
        ("(9)", "tracking_max_rad", 1.39e-3, 0.1),
        ("(9)", "disturbance_error_rms_rad_s2", 3.60, 0.05),
        ("(10)", "tracking_max_rad", 1.51e-2, 0.05),
        ("(10)", "damping", (0.1 + 129.9 / 5.4) / (2 * math.sqrt(4000 / 5.4)), 1e-9),
        ("(8)", "velocity_error_max_rad_s", 0.56, 0.05),
        ("III.A", "velocity_settled_s", 1.46, 0.03),
    ],
)
def test_printed_equation_costs_what_the_theory_says(
    reproduction: Reproduction, equation: str, quantity: str, expected: float, rel: float
) -> None:
    found = misprint(reproduction, equation, quantity)
    assert found.as_printed == pytest.approx(expected, rel=rel)
    assert found.passed
    assert found.corrected == row(reproduction, quantity).corrected
    assert not found.low <= found.corrected <= found.high


def test_claims_are_those_of_section_iv(reproduction: Reproduction) -> None:
    claimed = {found.quantity: found.claimed for found in reproduction.rows if found.claimed is not None}
    assert claimed == {
        "tracking_max_rad": 1e-4,
        "velocity_error_max_rad_s": 1e-4,
        "velocity_settled_s": 1.0,
        "damping": 1.0,
    }


def test_printed_columns_are_those_of_the_misprints(reproduction: Reproduction) -> None:
    tracking = row(reproduction, "tracking_max_rad")
    assert tracking.printed_eq9 == misprint(reproduction, "(9)", "tracking_max_rad").as_printed
    assert tracking.printed_eq10 == misprint(reproduction, "(10)", "tracking_max_rad").as_printed


def test_only_the_corrected_equations_reach_the_claim(reproduction: Reproduction) -> None:
    tracking = row(reproduction, "tracking_max_rad")
    assert tracking.claimed == 1e-4
    assert tracking.corrected < tracking.claimed < min(tracking.printed_eq9, tracking.printed_eq10)


@pytest.mark.untraced
def test_corrected_run_equals_the_shipped_rig_run_by_hand(reproduction: Reproduction) -> None:
    by_hand = run(load_rig("paper"), fast=True)
    assert reproduction.corrected.columns.keys() == by_hand.columns.keys()
    for name, column in by_hand.columns.items():
        if name not in {"period_us", "lateness_us", "compute_us"}:
            np.testing.assert_array_equal(reproduction.corrected.columns[name], column, err_msg=name)


def test_json_of_the_command_equals_the_api(
    reproduction: Reproduction, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    use(monkeypatch, reproduction)
    outcome = cli("paper", "--no-figures", "--json", "-")
    rows = json.loads(outcome.out)
    assert outcome.code == 0
    assert rows == as_json(reproduction.rows)
    assert [list(found) for found in rows] == [KEYS] * 8
    assert all(found["pass"] is True for found in rows)


def test_command_prints_both_tables_within_80_columns(
    reproduction: Reproduction, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    use(monkeypatch, reproduction)
    outcome = cli("paper", "--no-figures")
    assert outcome.code == 0
    for words in ("tracking error, max", "11.01", "1391", "15147", "1.456", "561.9", "tolerance", "yes"):
        assert words in outcome.out
    assert " no" not in outcome.out
    assert "…" not in outcome.out
    assert max(map(len, outcome.out.splitlines())) <= 80


@pytest.mark.parametrize("corrected", [1e-3, math.nan])
def test_command_exits_1_when_a_tolerance_is_missed(
    reproduction: Reproduction, cli: Cli, monkeypatch: pytest.MonkeyPatch, corrected: float
) -> None:
    missed = tuple(
        replace(found, corrected=corrected) if found.quantity == "tracking_max_rad" else found
        for found in reproduction.rows
    )
    use(monkeypatch, replace(reproduction, rows=missed))
    outcome = cli("paper", "--no-figures", "--json", "figures.json")
    assert outcome.code == 1
    assert " no" in outcome.out


def test_reproduction_stops_when_ctrl_c_ends_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(session: Session) -> None:
        session.stop.requested = True

    monkeypatch.setattr(Session, "run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        reproduce()


def test_velocity_has_settled_only_after_the_last_excursion() -> None:
    time = np.arange(5.0)
    assert settled_from(time, np.array([9.0, 0.0, -9.0, 0.0, 0.0]), 0.1) == 3.0
    assert settled_from(time, np.zeros(5), 0.1) == 0.0
    assert math.isnan(settled_from(time, np.array([0.0, 0.0, 0.0, 0.0, 9.0]), 0.1))
    assert settled_from(time, np.array([0.0, math.nan, 0.0, 0.0, 0.0]), 0.1) == 2.0


def test_damping_is_that_of_the_gains() -> None:
    rig = load_rig("paper", ["controller.kp_1_s2=100", "controller.kd_1_s=4"])
    assert damping(rig) == pytest.approx(4 / (2 * math.sqrt(100)))
