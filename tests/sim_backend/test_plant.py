"""The pendulum's physics against scipy, closed forms, and its own definition of w."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from dcmp_hil import run
from dcmp_hil.control.model import Model
from sim_backend.plant import EulerPlant, MoreauPlant
from tests.helpers import STEADY, bench, last

_FREE = Model(f0=0.0, f1=0.0, eta=0.0, eta_amplitude=0.0)
_H = 20e-6  # s, the step of the reference figures


def _moreau(
    plant: Model, *, position: float, step: float = _H, steps: int = 50, model: Model | None = None
) -> MoreauPlant:
    return MoreauPlant(plant, model or plant, position=position, step=step, steps=steps)


def _solve(plant: Model, x0: float, length: float, friction: float) -> tuple[float, float]:
    """Integrate eqs. (1)-(4) for a friction that does not change its sign."""
    answer = solve_ivp(
        lambda t, x: [
            x[1],
            -plant.f0 * x[1] + plant.external(t) + friction - plant.gravity * math.sin(x[0]),
        ],
        (0.0, length),
        [x0, 0.0],
        rtol=1e-11,
        atol=1e-12,
    )
    return float(answer.y[0, -1]), float(answer.y[1, -1])


@pytest.mark.parametrize("x0", [-1.57, 0.3, 3.0])
def test_moreau_plant_falls_freely_as_scipy_says(x0: float) -> None:
    plant = _moreau(_FREE, position=x0)
    truth = last(plant, 1000)
    x1, x2 = _solve(_FREE, x0, 1.0, 0.0)
    # First order: error about G h per second, 14.03 x 20e-6 = 2.8e-4
    assert truth.position == pytest.approx(x1, abs=1e-3)
    assert truth.velocity == pytest.approx(x2, abs=3e-3)


def test_moreau_plant_is_first_order_in_its_step() -> None:
    errors = []
    exact, _ = _solve(_FREE, -1.57, 1.0, 0.0)
    for steps in (10, 20, 40):
        plant = _moreau(_FREE, position=-1.57, step=1e-3 / steps, steps=steps)
        errors.append(abs(last(plant, 1000).position - exact))
    for coarse, fine in itertools.pairwise(errors):
        assert coarse / fine == pytest.approx(2.0, rel=0.1)


def test_moreau_plant_keeps_its_energy_when_nothing_brakes() -> None:
    plant = _moreau(_FREE, position=-1.57)
    start = -_FREE.gravity * math.cos(-1.57)  # rad2/s2, the energy over J
    for _ in range(20_000):  # 20 s, nine swings
        x1, x2, _ = plant.advance(0.0)
        energy = 0.5 * x2 * x2 - _FREE.gravity * math.cos(x1)
        # A step errs by h/2 x |x2| G |sin x1| at most, about 1e-3; what counts is that nothing adds up.
        assert energy == pytest.approx(start, abs=2e-3)


def test_moreau_plant_brakes_as_scipy_says_until_the_arm_turns() -> None:
    # From -1.57 towards hanging: the velocity is positive, friction is -f1.
    model = Model()
    plant = _moreau(model, position=-1.57, step=_H, steps=50)
    truth = last(plant, 400)
    assert truth.velocity > 0.0
    x1, x2 = _solve(model, -1.57, 0.4, -model.f1)
    assert truth.position == pytest.approx(x1, abs=5e-4)
    assert truth.velocity == pytest.approx(x2, abs=3e-3)


@pytest.mark.parametrize(
    ("volts", "moves"), [(0.0, False), (0.08, False), (0.09, True), (-0.39, False), (-0.40, True)]
)
def test_moreau_plant_sticks_until_the_drive_exceeds_friction(volts: float, moves: bool) -> None:
    # Hanging, eta/J = 0.84: f1 = 1.3 holds for -2.14 < 5.4 V < 0.46, that is -0.396 V .. 0.085 V
    plant = _moreau(Model(eta_amplitude=0.0), position=0.0)
    truth = last(plant, 100, volts)
    assert (truth.velocity != 0.0) == moves
    assert (truth.position != 0.0) == moves


@pytest.mark.untraced
def test_moreau_plant_truly_sticks_at_every_reversal_of_the_rig() -> None:
    # theory.md, section 3: the arm sticks 2..80 ms at each reversal, t = 3 pi, 5 pi .. s; 8..92 ms measured
    # over nine encoder phases, 92 where an edge of the encoder lies at the reversal as it does here.
    columns = run(bench(*STEADY), duration=30.13, fast=True).columns
    t, v = columns["time_s"], columns["velocity_true_rad_s"]
    for turn in (3, 5, 7, 9):
        near = (t > turn * math.pi - 0.3) & (t < turn * math.pi + 0.3)
        still = v[near] == 0.0
        longest = max((len(list(run)) for value, run in itertools.groupby(still) if value), default=0)
        assert 2 <= longest <= 100, f"stuck {longest} ms at {turn} pi"
        before, after = v[near][0], v[near][-1]
        assert before * after < 0.0


_models = st.builds(
    Model,
    f0=st.floats(0.0, 3.0),
    f1=st.floats(0.0, 3.0),
    ku=st.floats(1.0, 10.0),
    eta=st.floats(-2.0, 2.0),
    gravity=st.floats(0.0, 20.0),
    eta_amplitude=st.floats(-1.0, 1.0),
    eta_rate=st.floats(0.0, 1.0),
)


@settings(deadline=None)
@given(plant=_models, model=_models, volts=st.floats(-10.0, 10.0), x0=st.floats(-3.0, 3.0))
def test_true_disturbance_is_what_the_models_equation_leaves(
    plant: Model, model: Model, volts: float, x0: float
) -> None:
    # w = x2' + f0 x2 - (ku/J) V with the model's f0 and ku/J, x2' the step's mean (theory.md, section 1)
    simulated = _moreau(plant, position=x0, step=2e-4, steps=1, model=model)
    before = simulated.advance(volts)
    for k in range(1, 21):
        now = simulated.advance(volts)
        slope = (now.velocity - before.velocity) / 2e-4
        expected = slope + model.f0 * before.velocity - model.ku * volts
        assert now.disturbance == pytest.approx(expected, rel=1e-9, abs=1e-9)
        if before.velocity * now.velocity > 0.0:  # and while it slides, eq. (2) itself
            physical = (
                plant.external(k * 2e-4)
                - plant.gravity * math.sin(before.position)
                - math.copysign(plant.f1, now.velocity)
                + (model.f0 - plant.f0) * before.velocity
                + (plant.ku - model.ku) * volts
            )
            assert now.disturbance == pytest.approx(physical, abs=1e-9)
        before = now


def test_true_disturbance_stays_inside_friction_when_the_arm_sticks() -> None:
    plant = _moreau(Model(eta_amplitude=0.0), position=0.0)
    truth = last(plant, 50, -0.2)
    assert truth.disturbance == pytest.approx(5.4 * 0.2, rel=1e-12)  # at rest w + u = 0


def test_external_disturbance_is_the_papers() -> None:
    for t in (0.0, 2.0, 11.0):
        assert Model().external(t) == pytest.approx(0.84 + 0.2 * math.sin(t / 5.0), rel=1e-15)


def test_moreau_plant_feels_the_external_disturbance_at_its_own_time() -> None:
    # Without gravity and friction: x2 = int eta/J = 0.84 t + (1 - cos 0.2 t)
    plant = _moreau(Model(f0=0.0, f1=0.0, gravity=0.0), position=0.0, step=2e-4, steps=5)
    truth = last(plant, 10_000)
    assert truth.velocity == pytest.approx(0.84 * 10.0 + 1.0 - math.cos(2.0), abs=1e-3)


def test_euler_plant_takes_the_papers_step() -> None:
    # x' += h (-f0 x' + w + u), x += h x', w with the friction's sign, sgn(0) = 0 (eqs. 1-4)
    model = Model()
    plant = EulerPlant(model, model, position=-1.57, step=1e-4, steps=1)
    x1, x2 = -1.57, 0.0
    for k in range(200):
        w = -1.3 * float(np.sign(x2)) + 0.84 + 0.2 * math.sin(k * 1e-4 / 5) - 14.03 * math.sin(x1)
        x1, x2 = x1 + 1e-4 * x2, x2 + 1e-4 * (-0.1 * x2 + w + 5.4 * 1.5)
        truth = plant.advance(1.5)
        assert truth[:2] == pytest.approx((x1, x2), rel=1e-12)


def test_euler_plants_disturbance_is_eq_2_at_the_new_state() -> None:
    model = Model()
    plant = EulerPlant(model, Model(f0=0.3, ku=5.0), position=-1.57, step=1e-4, steps=10)
    for k in range(1, 50):
        x1, x2, w = plant.advance(2.0)
        eta = 0.84 + 0.2 * math.sin(k * 1e-3 / 5)
        expected = eta - 1.3 - 14.03 * math.sin(x1) + (0.3 - 0.1) * x2 + (5.4 - 5.0) * 2.0
        assert w == pytest.approx(expected, rel=1e-9)


def test_euler_plant_chatters_where_moreau_sticks() -> None:
    model = Model(eta_amplitude=0.0)
    naive = EulerPlant(model, model, position=0.0, step=1e-4, steps=1)
    velocities = [naive.advance(0.0).velocity for _ in range(200)]
    assert max(abs(v) for v in velocities) > 0.0
    assert min(velocities) < 0.0 < max(velocities)
