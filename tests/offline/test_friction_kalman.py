"""`friction_kalman` on recordings of a real pendulum, beside `super_twisting`, where they are at hand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.installed import Finished

    Script = Callable[..., Finished]

DATA = Path(__file__).resolve().parents[2] / ".." / "shared" / "data" / "dfki_pendulum"
pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the measured data is not at ../shared/data")

RIG = ("--inertia", "0.16", "--counts-per-rev", "2155.9", "--set", "model.f0_1_s=0.12")
MODEL = {"model.gravity_rad_s2": 20.0, "model.f1_rad_s2": 1.0625}  # of the published parameters
OTHERS = {
    "the paper's": {"model.gravity_rad_s2": 14.03, "model.f1_rad_s2": 1.3},
    "gravity -20 %, f1 x2": {"model.gravity_rad_s2": 16.0, "model.f1_rad_s2": 2.125},
}


def _errors(script: Script, name: str, kind: str, model: dict[str, float]) -> tuple[float, float]:
    """Return the RMS errors of velocity, rad/s, and disturbance, rad/s2, against the zero-phase reference."""
    settings = [f"observer.kind={kind}", *(f"{key}={value}" for key, value in model.items())]
    done = script(
        "replay",
        str(DATA / name),
        *RIG,
        *(word for one in settings for word in ("--set", one)),
        "--json",
        "-",
    )
    assert done.code == 0, done.err
    figures = json.loads(done.out)
    return figures["velocity_error_rms_rad_s"], figures["disturbance_error_rms_rad_s2"]


@pytest.mark.parametrize(
    ("name", "velocity", "disturbance"),
    [("swingup_333hz.csv", 0.08, 3.4), ("identification_300hz.csv", 0.20, 7.6)],
)
def test_errors_are_below_their_gates(script: Script, name: str, velocity: float, disturbance: float) -> None:
    v, w = _errors(script, name, "friction_kalman", MODEL)
    assert v < velocity
    assert w < disturbance


@pytest.mark.parametrize("model", OTHERS.values(), ids=OTHERS)
@pytest.mark.parametrize("name", ["swingup_333hz.csv", "identification_300hz.csv"])
def test_velocity_is_better_than_super_twistings_with_a_wrong_model(
    script: Script, name: str, model: dict[str, float]
) -> None:
    v, _ = _errors(script, name, "friction_kalman", model)
    other, _ = _errors(script, name, "super_twisting", model)
    assert v < 0.9 * other
