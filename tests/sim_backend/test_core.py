"""The simulated rig compiled from the C core: the bits of the Python plant, and a run without a compiler."""

from __future__ import annotations

import math
import random
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

from dcmp_hil import load_rig, run
from dcmp_hil.control.counted_random import CountedRandom
from dcmp_hil.errors import OpenError
from dcmp_hil.platform.clock import SimulatedClock
from sim_backend import core_library
from sim_backend.backend import SimBackend
from sim_backend.compiling.build import sources
from sim_backend.core_plant import CorePlant
from sim_backend.engine import engine_of
from sim_backend.hardware import CoreHardware, StagedHardware, make_hardware
from sim_backend.plant import EulerPlant, MoreauPlant, make_plant
from tests.firmware.core_library import WARNINGS

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.config import Rig
    from dcmp_hil.result import Result

pytestmark = pytest.mark.usefixtures("needs_compiler")

_CASES = {
    "nominal": (),
    "20 us": ("sim.step_us=20",),
    "saturated": ("amplifier.voltage_limit_V=2", "supervisor.error_limit_rad=none"),
    "stepped": ("sim.voltage_step_mV=37", "sim.dead_zone_V=0.1", "amplifier.slew_V_s=300"),
    "no delay": ("loop.delay_samples=0",),
    "lost samples": ("sim.lost_samples=0.1",),
    "noise": (
        "sim.encoder_noise_counts=0.7",
        "sim.encoder_phase_counts=0.3",
        "sim.seed=18446744073709551615",
    ),
    "noise, ideal encoder": ("encoder.counts_per_rev=ideal", "sim.encoder_noise_counts=1e-5"),
    "coarse encoder": ("encoder.counts_per_rev=1024",),
    "fine encoder": ("encoder.counts_per_rev=65536.5",),
    "misplaced edges": ("sim.encoder_edge_counts=0.3",),
    "another plant": ("sim.plant.f1_rad_s2=2", "sim.plant.ku_rad_s2_V=4", "sim.plant.gravity_rad_s2=0"),
    "on the board": ("backend.kind=sim-board",),
}


def _rig(*overrides: str, engine: str = "core") -> Rig:
    return load_rig("bench-1khz", ("supervisor.monitors=finite", *overrides, f"sim.engine={engine}"))


def _both(*overrides: str, faults: tuple[str, ...] = ()) -> list[Result]:
    rigs = [load_rig("bench-1khz", (*overrides, f"sim.engine={engine}")) for engine in ("core", "python")]
    return [run(rig, duration=0.5, fast=True, faults=faults) for rig in rigs]


def _same(core: Result, python: Result) -> None:
    assert core.columns.keys() == python.columns.keys()
    for name, column in core.columns.items():
        np.testing.assert_array_equal(column, python.columns[name], err_msg=name)


@pytest.mark.parametrize("case", _CASES)
def test_run_has_the_same_bits_on_the_core(case: str) -> None:
    monitors = () if case in ("nominal", "on the board") else ("supervisor.monitors=finite",)
    _same(*_both("supervisor.start=immediate", *monitors, *_CASES[case]))


@pytest.mark.parametrize(
    "faults", [("plant.shove:at=0.3s", "plant.enc_missed:at=0.1s"), ("plant.gain:at=0.2s,factor=0.5",)]
)
def test_run_with_faults_has_the_same_bits_on_the_core(faults: tuple[str, ...]) -> None:
    _same(*_both("supervisor.monitors=finite", "supervisor.error_limit_rad=none", faults=faults))


def _hardware(*overrides: str) -> tuple[CoreHardware, StagedHardware]:
    core, python = _rig(*overrides), _rig(*overrides, engine="python")
    compiled, staged = make_hardware(core, engine_of(core)), make_hardware(python, engine_of(python))
    assert isinstance(compiled, CoreHardware)
    assert isinstance(staged, StagedHardware)
    return compiled, staged


@pytest.mark.parametrize("overrides", [("amplifier.voltage_limit_V=none", "loop.delay_samples=0"), ()])
def test_huge_and_undefined_voltages_have_the_same_bits(overrides: tuple[str, ...]) -> None:
    pair = _hardware("sim.voltage_step_mV=0.001", *overrides)
    draw = random.Random(1)
    for period in range(400):
        size = draw.choice((math.nan, math.inf, 0.0, 10.0 ** draw.uniform(-320, 308)))
        voltage = draw.choice((size, -size))
        samples = [hardware.sample() for hardware in pair]
        assert str(samples[0]) == str(samples[1]), period
        assert str(pair[0].truth()) == str(pair[1].truth()), period
        for hardware in pair:
            hardware.command(voltage)


def test_released_hardware_forgets_its_commands_alike() -> None:
    pair = _hardware("amplifier.slew_V_s=500")
    for hardware in pair:
        hardware.sample()
        hardware.command(3.0)
        hardware.advance()
        hardware.release()
    got = [[(hardware.sample(), hardware.truth()) for _ in range(5)] for hardware in pair]
    assert got[0] == got[1]
    assert [sample[2] for sample, _ in got[0]] == [0.0] * 5


def test_skipped_periods_have_the_same_bits() -> None:
    got = []
    for engine in ("core", "python"):
        clock = SimulatedClock()
        with SimBackend(
            _rig("timing.overrun=skip", "sim.encoder_noise_counts=1", engine=engine), clock
        ) as backend:
            samples = []
            for period in range(50):
                samples.append(backend.read())
                backend.write(math.sin(period))
                clock.sleep_until_ns(clock.now_ns() + (period % 3) * 1_400_000)
        got.append(samples)
    assert got[0] == got[1]
    assert len({sample.t for sample in got[0]}) == 50
    assert got[0][-1].t > 0.055


def test_stretched_plant_has_the_same_bits() -> None:
    plants = [make_plant(_rig(engine=engine)) for engine in ("core", "python")]
    assert [type(plant) for plant in plants] == [CorePlant, MoreauPlant]
    for period in range(300):
        states = [plant.advance(5.0 * math.sin(0.01 * period)) for plant in plants]
        assert states[0] == states[1]
        if period % 100 == 50:
            for plant in plants:
                plant.stretch(1.07)


def test_a_plant_that_the_core_does_not_have_runs_in_python() -> None:
    euler, detailed = _rig("sim.integrator=euler"), _rig("sim.cogging_rad_s2=1")
    assert isinstance(make_plant(euler), EulerPlant)
    for rig in (euler, detailed, _rig(engine="python")):
        assert engine_of(rig) == (False, "")


@pytest.fixture
def without_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have an empty cache and no compiler."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(core_library, "load", core_library.load.__wrapped__)
    monkeypatch.setattr("sim_backend.engine.load", core_library.load)


@pytest.mark.usefixtures("without_compiler")
def test_without_a_compiler_the_python_plant_runs_and_the_run_says_so_once() -> None:
    result = run(load_rig("bench-1khz"), duration=0.1, fast=True)
    (said,) = [event for event in result.events if event.level == "WARN"]
    assert said.text == (
        "The simulated plant runs in Python, with the same results in more time. "
        "The simulated plant needs a C compiler, and there is none: apt install gcc libc6-dev"
    )


@pytest.mark.usefixtures("without_compiler")
def test_a_rig_that_asks_for_python_needs_no_compiler_and_says_nothing() -> None:
    result = run(load_rig("bench-1khz", ["sim.engine=python"]), duration=0.1, fast=True)
    assert [event.text for event in result.events if event.level == "WARN"] == []


def test_compiler_that_fails_leaves_the_python_plant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("CC", "false")
    monkeypatch.setattr("sim_backend.engine.load", core_library.load.__wrapped__)
    engine = engine_of(_rig())
    assert not engine.core
    assert "\n" not in engine.remark
    assert "CC" in engine.remark or "compile" in engine.remark
    assert isinstance(make_hardware(_rig(), engine), StagedHardware)


def test_library_that_cannot_be_loaded_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken.so").write_text("no library")
    monkeypatch.setattr("sim_backend.core_library.compiled", lambda _: tmp_path / "broken.so")
    monkeypatch.setattr("sim_backend.engine.load", core_library.load.__wrapped__)
    assert "broken.so: cannot be loaded" in engine_of(_rig()).remark


def test_board_whose_plant_does_not_compile_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise OpenError("cc: the simulated plant does not compile.")

    monkeypatch.setattr("sim_backend.engine.load", fail)
    result = run(load_rig("bench-1khz", ["backend.kind=sim-board"]), duration=0.1, fast=True)
    (said,) = [event.text for event in result.events if "runs in Python" in event.text]
    assert said.endswith("in more time. cc: the simulated plant does not compile.")


def test_two_processes_at_once_compile_one_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    code = (
        "from sim_backend.compiling.build import compiled\n"
        "from sim_backend.core_library import TARGET, load\nload()\nprint(compiled(TARGET))"
    )
    running = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) for _ in range(2)
    ]
    paths = {process.communicate(timeout=120)[0].strip() for process in running}
    assert len(paths) == 1
    assert [str(path) for path in tmp_path.rglob("*.so")] == list(paths)


def test_random_numbers_are_those_of_python() -> None:
    """An ideal encoder at 0 rad with a deviation of 1 rad shows the numbers themselves."""
    rig = _rig(
        "encoder.counts_per_rev=ideal", "sim.encoder_noise_counts=1", "sim.seed=7", "sim.plant.eta_rad_s2=0"
    )
    hardware = make_hardware(rig, engine_of(rig))
    hardware.sample()
    normal = CountedRandom(7, 0).normal
    assert [hardware.read()[0] for _ in range(300)] == [normal(n) for n in range(1, 301)]


@pytest.mark.skipif(shutil.which("clang") is None, reason="clang is not there")
def test_clang_makes_a_library_with_the_same_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    overrides = "sim.encoder_noise_counts=0.7", "sim.lost_samples=0.1", "amplifier.slew_V_s=900"

    def ride() -> list[object]:
        hardware = make_hardware(_rig(*overrides), engine_of(_rig(*overrides)))
        got: list[object] = []
        for period in range(300):
            got.append((hardware.sample(), hardware.truth()))
            hardware.command(8.0 * math.sin(0.1 * period))
        return got

    found = ride()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("CC", "clang")
    monkeypatch.setattr("sim_backend.hardware.load", core_library.load.__wrapped__)
    assert str(ride()) == str(found)
    assert list(tmp_path.rglob("*.so"))


@pytest.mark.parametrize("name", ["gcc", "clang"])
def test_library_compiles_without_a_warning(tmp_path: Path, name: str) -> None:
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not there")
    warnings = [flag for flag in WARNINGS if flag != "-ffreestanding"]
    root = sources()
    command = [name, *warnings, *core_library.TARGET.flags, "-O2", f"-I{root / 'core'}"]
    subprocess.run(
        [*command, str(root / "boards/simlib/simlib.c"), "-o", str(tmp_path / "made.so")], check=True
    )
