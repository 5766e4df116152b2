"""The exact loop as a matrix: its margins against simulation, and rigs that are refused by them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import load_rig, run
from dcmp_hil.config.gain_rules import loops
from dcmp_hil.errors import ConfigError, TripError
from dcmp_hil.live.tunables import changed
from dcmp_hil.session import Session
from tests.helpers import bench, known

if TYPE_CHECKING:
    from pathlib import Path


def test_margins_of_the_default_are_those_that_were_measured() -> None:
    # motor gain where simulation stays good: .48 to 2.7
    margins = loops(bench())[0].margins()
    assert margins is not None
    assert margins.low == pytest.approx(0.46, abs=0.01)
    assert margins.high == pytest.approx(2.68, abs=0.02)


def test_matrix_carries_the_loop_as_the_loop_itself_does() -> None:
    # No gravity, no friction, an ideal encoder and no sliding term: what is left is linear, to rounding.
    rig = bench(
        "encoder.counts_per_rev=ideal", "observer.M_rad_s3=0", "observer.mu0_rad_s=40", "sim.step_us=1000",
        "model.gravity_rad_s2=0", "model.f1_rad_s2=0", "model.eta_rad_s2=0", "model.eta_amplitude_rad_s2=0",
        "supervisor.start=immediate", "reference.kind=hold", "reference.soft_start_s=0", "model.f0_1_s=0",
        "sim.position_rad=0.001",
    )  # fmt: skip
    columns = run(rig, duration=0.3, fast=True).columns
    loop = loops(rig)[0]
    matrix, state = loop.matrix()[:10, :10], np.zeros(10)
    state[[0, 4, 5]] = 0.001  # the arm, the last count, the copy: the observer starts where the arm is
    voltages = []
    for _ in range(299):
        state = matrix @ state
        voltages.append(state[3])
    sent = columns["voltage_sent_V"]
    assert np.abs(np.diff(voltages)).max() > 1e-3
    assert np.corrcoef(voltages[1:250], sent[1:250])[0, 1] > 0.99


@pytest.mark.parametrize("overrides", [(), ("observer.mu0_rad_s=80",), ("encoder.counts_per_rev=1000",)])
def test_noise_of_the_voltage_is_what_a_run_shows(overrides: tuple[str, ...]) -> None:
    rig = bench(*overrides)
    _, change = loops(rig)[0].noise_V()
    predicted = np.sqrt(2.0 / np.pi) * change / rig.period  # V/s
    measured = known(run(rig, duration=12.0, fast=True, window_from=4.0).summary.voltage_tv_V_s)
    assert measured / predicted == pytest.approx(1.1, abs=0.25)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("controller.kp_1_s2=1e6", r"controller\.kp_1_s2: got 1000000; the loop is not stable"),
        ("controller.kd_1_s=2000.0", r"controller\.kd_1_s: got 2000; .* shake by 46 V"),
        ("controller.kd_1_s=10.0", r"motor gains of 0\.64 to 1\.11 times"),
        ("observer.mu0_rad_s=300.0", r"observer\.mu0_rad_s: got 300; .* shake by 5\.5 V"),
        ("observer.M_rad_s3=1e6", r"observer\.M_rad_s3: got 1000000;"),
        ("observer.L2_1_s2=1e5", r"motor gains of 0\.40 to 1\.03 times"),
        ("loop.rate_hz=50", r"loop\.rate_hz: got 50; the loop is not stable"),
    ],
)
def test_gains_that_the_loop_cannot_bear_are_refused_with_the_margin(override: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        load_rig("bench-1khz", [override])


def test_motor_beyond_the_margin_runs_away_and_inside_it_does_not() -> None:
    low, high = loops(bench())[0].margins() or (0.0, 0.0)
    common = ("supervisor.probe=off", "supervisor.disturbance_limit_rad_s2=1e6")

    def shakes(gain: float) -> float:
        rig = bench(f"sim.plant.ku_rad_s2_V={5.4 * gain}", *common)
        session = Session(rig, duration=6.0, fast=True, window_from=4.0)
        try:
            session.run()
        except TripError:
            return float("inf")
        return known(session.result().summary.voltage_tv_V_s)

    assert shakes(0.85 * high) < 150.0  # V/s; 62 as believed
    assert shakes(1.25 * high) > 250.0
    assert shakes(1.2 * low) < 150.0


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("observer.L1_1_s=1e5", r"observer\.L1_1_s: got 100000; explicit Euler steps"),
        ("observer.L1_1_s=1500.0", "moves the estimated velocity"),
        ("observer.M_rad_s3=1e7", "moves the estimated velocity"),
        ("observer.M_rad_s3=1e5", "swings by 100 rad/s2"),
    ],
)
def test_gains_that_explicit_euler_cannot_bear_are_refused(override: str, words: str) -> None:
    load_rig("bench-1khz", ["observer.kind=paper"])
    with pytest.raises(ConfigError, match=words):
        load_rig("bench-1khz", ["observer.kind=paper", override])


def test_gains_that_overflow_are_refused_without_a_word_of_numpy(recwarn: pytest.WarningsRecorder) -> None:
    with pytest.raises(ConfigError, match="ku_rad_s2_V"):
        load_rig("bench-1khz", ["model.ku_rad_s2_V=5e-324"])
    assert not recwarn.list


WALK = (0, 3, -1, 6, 6, -3, 1, -6, 0, 6, -6, 3, 6, 1, 0, -6, 6, 0, -3, 6, 0, 0)


def led_to_its_limits(folder: Path, *overrides: str) -> str:
    """Run along a reference that jumps to both limits; return the reason of a trip, or nothing."""
    file = folder / "jumps.csv"
    rows = "".join(f"{0.2 * k:.1f},{where}\n" for k, where in enumerate(WALK))
    file.write_text("time_s,position_rad\n" + rows)
    rig = load_rig("bench-1khz", ["reference.kind=csv", f"reference.file={file}", *overrides])
    try:
        Session(rig, duration=5.0, fast=True, keep_columns=False).run()
    except TripError as trip:
        return trip.reason
    return ""


@pytest.mark.parametrize("counts", [256, 4096, 65_536])
def test_an_observer_that_gravity_leaves_behind_is_refused(tmp_path: Path, counts: int) -> None:
    encoder = f"encoder.counts_per_rev={counts}"
    for overrides in (["observer.mu0_rad_s=0"], ["observer.mu0_rad_s=2", "observer.M_rad_s3=100"]):
        with pytest.raises(ConfigError, match=r"observer\.mu0_rad_s: got [02]; a floor below 4 rad/s"):
            load_rig("bench-1khz", [encoder, *overrides])
    with pytest.raises(ConfigError, match="a floor below 4 rad/s"):
        changed(load_rig("bench-1khz", [encoder]), ["observer.mu0_rad_s=1e-3", "observer.M_rad_s3=0.1"])
    assert led_to_its_limits(tmp_path, encoder, "observer.mu0_rad_s=4") not in ("travel", "speed")
    if counts >= 4096:  # the remedy
        assert not led_to_its_limits(tmp_path, encoder, "observer.mu0_rad_s=0", "observer.M_rad_s3=281")
