"""Live changes in virtual time: no step in the voltage, nothing beyond a limit, nothing unasked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dcmp_hil.ipc.mailbox import APPLIED, FAILED, LOWERING
from tests.helpers import T
from tests.live.here import ChangedRun

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from dcmp_hil.result import Result

_AT = 3500  # samples: full authority, the soft start is over
_IDEAL = (
    "encoder.counts_per_rev=ideal",
    "sim.plant.f1_rad_s2=0.0",
    "observer.M_rad_s3=0.0",
    "observer.mu0_rad_s=40.0",
)
"""No counts and no friction that sticks: what is left of a step in the voltage is the change's own."""


def _largest_step(voltage: NDArray[np.float64], at: int, periods: int) -> float:
    return float(np.abs(np.diff(voltage[at - 2 : at + periods])).max())


def _without() -> Result:
    return ChangedRun({}, *_IDEAL).run()


@pytest.mark.parametrize(
    "overrides",
    [
        ("controller.kp_1_s2=9000",),
        ("controller.kp_1_s2=1000", "controller.kd_1_s=60"),
        ("controller.kind=pd",),
        ("observer.mu0_rad_s=80",),
        ("observer.L1_1_s=20", "observer.L2_1_s2=60"),
        ("observer.M_rad_s3=100",),
        ("reference.amplitude_rad=0.5",),
        ("reference.rate_rad_s=2",),
        ("reference.phase_rad=1", "reference.offset_rad=-0.3"),
        ("reference.kind=hold", "reference.position_rad=0.4"),
        ("reference.kind=trapezoid", "reference.acceleration_rad_s2=0.1"),
        ("reference.kind=chirp",),
    ],
)
def test_voltage_has_no_step_when_a_change_is_applied(overrides: Sequence[str]) -> None:
    run = ChangedRun({_AT: overrides}, *_IDEAL)
    result = run.run()
    assert result.troubles == ()
    voltage = result.columns["voltage_sent_V"]
    plain = _without().columns["voltage_sent_V"]
    assert run.answers[0] is not None
    assert run.answers[0].what == APPLIED
    assert np.array_equal(voltage[: _AT + 1], plain[: _AT + 1])
    assert not np.array_equal(voltage, plain)
    # V in a period: what the way into another reference asks for, and a ramp at a lag of the observer's
    assert _largest_step(voltage, _AT, 300) < _largest_step(plain, _AT, 300) + 0.06


def test_a_change_at_once_would_be_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dcmp_hil.live.live_changes.GAIN_RAMP_TIME_S", 1e-9)
    voltage = ChangedRun({_AT: ["controller.kind=pd"]}, *_IDEAL).run().columns["voltage_sent_V"]
    assert _largest_step(voltage, _AT, 300) > 1.0  # V


def test_reference_and_its_derivatives_have_no_jump_when_it_changes() -> None:
    columns = (
        ChangedRun({_AT: ["reference.kind=hold", "reference.position_rad=-1.0"]}, duration=6.0).run().columns
    )
    x, v = columns["position_reference_rad"], columns["velocity_reference_rad_s"]
    around = slice(_AT - 5, _AT + 1500)
    assert np.abs(np.diff(x[around])).max() < 2.5e-3  # rad in a period, at 2.5 rad/s
    assert np.abs(np.diff(v[around])).max() < 12e-3  # rad/s in a period, at 12 rad/s2
    assert np.abs(np.diff(x) / T - 0.5 * (v[1:] + v[:-1]))[around].max() < 1e-3
    assert x[_AT] > 0.9
    assert x[-1] == pytest.approx(-1.0, abs=0.1)  # rad: almost there


def test_reference_is_the_new_one_after_the_bridge() -> None:
    script = {_AT: ["reference.amplitude_rad=0.9"], _AT + 100: ["reference.amplitude_rad=0.5"]}
    columns = ChangedRun(script, duration=6.0).run().columns
    wanted = 0.5 * np.sin(0.5 * _since_start(columns)[-1])
    assert columns["position_reference_rad"][-1] == pytest.approx(wanted, abs=1e-12)


def _since_start(columns: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the trajectory's own time, s: it starts where a tracking error is first known."""
    t = columns["time_s"]
    first: float = t[~np.isnan(columns["tracking_error_mrad"])][0]
    return t - first


def test_gains_are_the_new_ones_after_the_ramp() -> None:
    run = ChangedRun({_AT: ["controller.kp_1_s2=9000", "controller.kd_1_s=200"]})
    run.run()
    line = run.held.session._stages  # noqa: SLF001 - no public attribute shows it
    assert line.controller.gains == (9000.0, 200.0, 1.0)  # type: ignore[attr-defined]


def test_events_and_result_tell_of_a_change() -> None:
    run = ChangedRun({_AT: ["controller.kp_1_s2=5200"]})
    result = run.run()
    sentence = "controller.kp_1_s2: 4000 -> 5200, applied at t = 3.500 s"
    assert result.changes == (sentence,)
    assert [event.level for event in result.events if event.text == sentence] == ["INFO"]
    assert run.control.last_words == "Amplifier at 0 V."


@pytest.mark.parametrize("withdrawn", [True, False])
def test_run_is_the_same_to_the_bit_when_no_change_is_applied(*, withdrawn: bool) -> None:
    run = ChangedRun({})
    if withdrawn:
        mailbox = run.control.mailbox
        mailbox.words[0] = 1
    result, plain = run.run(), ChangedRun({}).run()
    assert result.changes == ()
    for name, column in plain.columns.items():
        assert np.array_equal(column, result.columns[name], equal_nan=True), name


def test_run_goes_on_when_the_slot_holds_rubbish() -> None:
    from dcmp_hil.control.change import Change

    run = ChangedRun({_AT: Change("nonsense", {}, tuning=(1.0,))})
    result = run.run()
    assert run.answers[0] is not None
    assert run.answers[0].what == FAILED
    assert result.changes == ()
    assert any("a change could not be applied" in trouble for trouble in result.troubles)
    assert result.summary.periods == 5000


def test_reference_is_not_changed_when_the_arm_is_being_lowered() -> None:
    run = ChangedRun({5500: ["reference.amplitude_rad=0.5"]}, "run.end=lower")
    result = run.run()
    assert run.answers[0] is not None
    assert run.answers[0].what == LOWERING
    assert result.changes == ()
    assert abs(result.columns["position_reference_rad"][-1]) < 1e-4


_CHANGES = st.one_of(
    st.floats(0, 1e5).map(lambda v: f"controller.kp_1_s2={v}"),
    st.floats(0, 1e3).map(lambda v: f"controller.kd_1_s={v}"),
    st.sampled_from(["controller.kind=pd", "controller.kind=pd_compensated"]),
    st.floats(0, 300).map(lambda v: f"observer.mu0_rad_s={v}"),
    st.floats(0.01, 100).map(lambda v: f"observer.L1_1_s={v}"),
    st.floats(0, 2000).map(lambda v: f"observer.M_rad_s3={v}"),
    st.floats(-10, 10).map(lambda v: f"reference.offset_rad={v}"),
    st.floats(0, 20).map(lambda v: f"reference.amplitude_rad={v}"),
    st.floats(0.01, 100).map(lambda v: f"reference.rate_rad_s={v}"),
)
_SCRIPTS = st.dictionaries(st.integers(1, 3900), _CHANGES.map(lambda one: [one]), min_size=1, max_size=12)


@pytest.mark.untraced
@settings(max_examples=25, deadline=None)
@given(script=_SCRIPTS, seed=st.integers(0, 1000))
def test_no_sequence_of_changes_breaks_a_limit(script: dict[int, list[str]], seed: int) -> None:
    from dcmp_hil.errors import TripError

    run = ChangedRun(script, f"sim.seed={seed}", duration=4.0, refusals=True)
    try:
        run.run()
        tripped = False
    except TripError:
        tripped = True
    columns = run.held.session.result().columns
    assert np.abs(columns["voltage_sent_V"]).max() <= 10.0
    assert np.isfinite(columns["voltage_sent_V"]).all()
    assert np.abs(columns["position_reference_rad"]).max() <= 0.95 * 6.2832 + 1e-9  # where it is held
    assert np.abs(columns["position_true_rad"]).max() <= 6.2832
    assert np.abs(columns["velocity_true_rad_s"]).max() <= 20.0
    if tripped:
        assert columns["voltage_sent_V"][-1] == 0.0
