"""The simulated rig in C: the bits of sim_backend's plant, encoder and amplifier."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil.control.counted_random import CountedRandom
from dcmp_hil.control.model import Model
from sim_backend.amplifier import Amplifier
from sim_backend.encoder import Encoder
from sim_backend.plant import MoreauPlant
from tests.firmware.law import Array, Law, same_bits

if TYPE_CHECKING:
    from tests.firmware.bench import Core

BELIEVED = Model()
PLANTS = {
    "nominal": Model(),
    "without gravity": Model(gravity=0.0),
    "without friction": Model(f0=0.0, f1=0.0),
    "sticking": Model(f1=60.0),
    "fast push": Model(eta_amplitude=30.0, eta_rate=300.0),
}
POSITIONS = np.concatenate(
    [
        np.random.default_rng(1).uniform(-20.0, 20.0, 2000),
        [0.0, -0.0, 1e-300, 1e12, -1e13, 1e300, math.inf, -math.inf, math.nan],
    ]
)
COMMANDS = np.concatenate(
    [
        np.random.default_rng(2).uniform(-14.0, 14.0, 2000),
        np.linspace(-1.0, 1.0, 401),
        [0.0, -0.0, 1e-300, 1e300, -1e300, math.inf, -math.inf, math.nan, 5.0, 0.0],
    ]
)


def _setup(plant: Model, h: float) -> Array:
    return np.array([*plant, BELIEVED.f0, BELIEVED.ku, h, 0.4])


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("steps", [1, 5, 50])
def test_plant_has_the_bits_of_python(core: Core, plant: str, steps: int) -> None:
    voltages = np.concatenate([COMMANDS[:300], [0.0] * 50, [1e300, -1e308, 1.0, math.nan, 0.0]])
    h = 1e-3 / steps
    python = MoreauPlant(PLANTS[plant], BELIEVED, position=0.4, step=h, steps=steps)
    wanted = np.array([python.advance(voltage) for voltage in voltages.tolist()])
    got = Law(core)("plant", _setup(PLANTS[plant], h), steps, voltages, width=3)
    assert same_bits(got, wanted)
    assert np.ptp(wanted[:300, 0]) > 0.0 or plant == "sticking"


@pytest.mark.parametrize(("counts", "phase"), [(4096.0, 0.0), (1000.5, 0.3), (65536.0, 0.999), (None, 0.0)])
@pytest.mark.parametrize("noise", [0.0, 1e-5, 0.7])
def test_encoder_has_the_bits_of_python(core: Core, counts: float | None, phase: float, noise: float) -> None:
    python = Encoder(counts, phase=phase, noise=noise, seed=5)
    wanted = np.array([python.read(position) for position in POSITIONS.tolist()])
    drawn = CountedRandom(5, 0).normal
    rows = np.array([(position, drawn(n)) for n, position in enumerate(POSITIONS.tolist())])
    count = 2.0 * math.pi / counts if counts else 0.0
    assert same_bits(Law(core)("encoder", np.array([count, phase, noise]), rows), wanted)


@pytest.mark.parametrize("delay", [0, 1, 2, 3])
@pytest.mark.parametrize(
    ("limit", "slew", "dead_zone", "quantum"),
    [
        (10.0, math.inf, 0.0, 0.0),
        (math.inf, math.inf, 0.0, 0.0),
        (10.0, 0.45, 0.4, 0.1),
        (10.0, math.inf, 0.0, 0.35),  # 10 V is nearest to 10.15 V
        (10.0, math.inf, 0.0, 0.5),  # the limit is a whole number of steps: it can be reached
        (0.5, math.inf, 0.0, 0.35),  # the same where steps are below 1 V
        (math.inf, math.inf, 0.0, 1e-6),
        (2.0, 1e-3, 0.01, 0.0),
    ],
)
def test_amplifier_has_the_bits_of_python(
    core: Core, limit: float, slew: float, dead_zone: float, quantum: float, delay: int
) -> None:
    python = Amplifier(limit=limit, slew=slew, dead_zone=dead_zone, quantum=quantum, delay_samples=delay)
    python.live = True
    wanted = []
    for command in COMMANDS.tolist():
        python.command(command)
        wanted.append(python.step())
    setup = np.array([limit, slew, dead_zone, quantum, delay], float)
    assert same_bits(Law(core)("amplifier", setup, COMMANDS), np.array(wanted))


def test_single_precision_follows_for_a_second(core: Core) -> None:
    voltages = np.sin(0.01 * np.arange(1000.0)) * 4.0
    single, double = (
        Law(core, kind)("plant", _setup(Model(), 2e-4), 5, voltages, width=3) for kind in ("float_", "")
    )
    assert np.abs(single - double)[:, 0].max() < 1e-3
