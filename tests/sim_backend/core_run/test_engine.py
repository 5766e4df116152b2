"""What the core takes, what it leaves to the loop, and what is said of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import pytest

from dcmp_hil import run, simulate
from dcmp_hil.assembly import assemble
from dcmp_hil.control.observers.super_twisting import SuperTwisting
from dcmp_hil.errors import OpenError
from dcmp_hil.platform.clock import SimulatedClock
from dcmp_hil.values import Estimate, Reference, Sample
from sim_backend.compiling.header import read
from sim_backend.core_run import library
from sim_backend.core_run.engine import CoreEngine
from sim_backend.core_run.library import load
from sim_backend.core_run.parameters import values_of
from sim_backend.core_run.words import CoreEnd, Words
from tests.helpers import bench, named
from tests.stages import ZeroController

if TYPE_CHECKING:
    from pathlib import Path

    from dcmp_hil.config import Rig
    from dcmp_hil.loop import LoopStages
    from dcmp_hil.telemetry.recorder import Recorder


def _made(rig: Rig) -> tuple[LoopStages, Recorder]:
    return assemble(rig, SimulatedClock(), [], in_line=True)


@pytest.mark.parametrize(
    ("overrides", "says"),
    [
        (("sim.engine=python",), "sim.engine"),
        (("sim.integrator=euler",), "euler"),
        (("sim.stribeck_ratio=1.5",), "details"),
        (("sim.encoder_edge_counts=0.1",), "edges"),
        (("backend.kind=sim-board",), "sim-board"),
        (("observer.kind=kalman",), "Kalman"),
        (("observer.kind=paper",), "PaperObserver"),
    ],
)
def test_the_loop_runs_what_the_core_has_not_and_says_why(overrides: tuple[str, ...], says: str) -> None:
    result = simulate(bench(*overrides), 0.01)
    assert result.engine == "plain"
    assert says in result.engine_reason


def test_a_class_of_ones_own_runs_in_the_loop() -> None:
    result = simulate(bench(f"controller.kind={named(ZeroController)}"), 0.01)
    assert result.engine == "plain"
    assert "controller" in result.engine_reason


@pytest.mark.parametrize(
    "fault", ["plant.shove:rad_s2=30,at=5ms,for=1ms", "host.raise:where=observer,at=50ms"]
)
def test_a_fault_runs_in_the_loop_and_is_the_reason(fault: str) -> None:
    result = simulate(bench(), 0.004, faults=[fault])
    assert result.engine == "plain"
    assert result.engine_reason.startswith("the core injects no faults")


def test_observers_beside_the_loop_run_in_the_loop() -> None:
    result = simulate(bench(), 0.01, compare=["kalman"])
    assert (result.engine, "beside the loop" in result.engine_reason) == ("plain", True)


def test_a_subclass_of_a_stage_runs_in_the_loop() -> None:
    class _Own(SuperTwisting):
        pass

    rig = bench()
    stages, recorder = _made(rig)
    assert not CoreEngine().refusal(rig, stages, recorder)
    own = replace(stages, observer=_Own(rig.observer_context))
    assert "_Own" in CoreEngine().refusal(rig, own, recorder)


def test_without_a_compiler_the_loop_runs_and_says_what_is_missing() -> None:
    def missing() -> NoReturn:
        raise OpenError("no compiler: install one")

    rig = bench()
    assert CoreEngine(missing).refusal(rig, *_made(rig)) == "no compiler: install one"


def test_a_library_that_cannot_be_loaded_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(library, "compiled", lambda _: tmp_path / "librun.so")
    with pytest.raises(OpenError, match="Delete"):
        load.__wrapped__()


def test_a_run_in_real_time_has_the_loop_and_no_reason() -> None:
    result = run(bench(), duration=0.01)
    assert (result.engine, result.engine_reason) == ("plain", "")


def test_simulate_is_a_fast_run() -> None:
    rig = bench()
    one, other = simulate(rig, 0.5), run(rig, duration=0.5, fast=True)
    assert one.engine == other.engine == "core"
    assert one.engine_reason == ""
    assert repr(one.columns) == repr(other.columns)
    assert simulate(bench("run.duration_s=0.1")).periods == 100
    assert simulate(rig, 0.1, plain=True).engine == "plain"


def test_every_parameter_of_the_header_has_a_value() -> None:
    rig = bench()
    stages, _ = _made(rig)
    loaded = load()
    values = values_of(rig, stages, loaded.constants)
    names = loaded.structures["run_parameters"].names or ()
    assert set(names) <= set(values)
    steps = np.array(values["watch"]["steps"]).reshape(loaded.constants["RUN_GAPS"], -1)
    assert steps.shape[1] == loaded.constants["RUN_STEP_NUMBERS"]


def test_every_cause_of_the_core_has_words() -> None:
    rig = bench()
    stages, _ = _made(rig)
    supervisor: Any = stages.supervisor
    words = Words(rig, supervisor, load().constants)
    cycle: Any = _Cycle()
    for cause in load().causes.values():
        if cause != "NONE":
            request = words.request(CoreEnd(cause, 1.5, 0.25, 0.125, 2.0, cycle, list))
            assert request.sentence
            assert request.remedy or cause == "DISTURBANCE"


class _Cycle:
    """What the words need of the last cycle."""

    sample, estimate = Sample(1.5, 0.25, 1.0), Estimate(0.25, 0.0, float("nan"))
    reference = Reference(0.0, 0.0, 0.0)


def test_a_header_with_a_structure_inside_another_is_read() -> None:
    one, two = (
        "struct one {\n    double x;\n};\n",
        "struct two {\n    struct one of[N * M];\n    int64_t n;\n};\n",
    )
    found = read(f"{one}{two}#define N 2\nenum {{ M = 3, K = 4 }};\n", {"L": 5})
    assert found.constants == {"N": 2, "M": 3, "K": 4, "L": 5}
    assert found.structures["two"].itemsize == 7 * 8
