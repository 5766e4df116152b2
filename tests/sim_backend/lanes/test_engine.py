"""Refusals of the lanes, and how the lanes are found."""

from __future__ import annotations

import pytest

from dcmp_hil.config.sections import PLANTS
from dcmp_hil.errors import OpenError
from sim_backend.lanes import layout
from sim_backend.lanes.engine import LaneEngine
from sim_backend.lanes.instruction_sets import PLAIN, SETS, available
from sim_backend.lanes.library import LANES, Lanes
from tests.helpers import bench
from tests.sim_backend.lanes.runs import rig_of

REFUSED = {
    "backend.kind=sim-board": "simulate no wire",
    "observer.kind=kalman": "super_twisting alone",
    "supervisor.start=engage": 'supervisor.start = "immediate"',
    "run.end=lower": 'run.end = "release"',
    "sim.engine=python": "sim.engine",
    "sim.cogging_rad_s2=1": "cogging",
    "sim.encoder_edge_counts=0.1": "sim.encoder_edge_counts = 0",
}


@pytest.mark.parametrize("override", REFUSED)
def test_a_refusal_names_its_reason(override: str) -> None:
    assert REFUSED[override] in LaneEngine().refusal(rig_of(override))


def test_friction_is_not_fed_forward_over_gaps() -> None:
    rig = rig_of("controller.friction_feedforward=true", "sim.lost_samples=0.1")
    assert "sim.lost_samples" in LaneEngine().refusal(rig)


@pytest.mark.parametrize("name", [name for name in PLANTS if name != "moreau"])
def test_another_plant_is_refused(name: str) -> None:
    assert "sim.integrator" in LaneEngine().refusal(rig_of(f"sim.integrator={name}"))


def test_the_default_start_is_refused_and_an_immediate_one_is_not() -> None:
    assert LaneEngine().refusal(bench())
    assert not LaneEngine().refusal(rig_of())


def test_no_compiler_is_a_refusal_that_is_looked_for_once() -> None:
    asked = []

    def load() -> Lanes:
        asked.append(1)
        raise OpenError("No compiler here: apt install gcc")

    lanes = LaneEngine(library=load)
    assert [lanes.refusal(rig_of()) for _ in range(2)] == 2 * ["No compiler here: apt install gcc"]
    assert len(asked) == 1


def test_no_runs_have_no_outcomes() -> None:
    assert LaneEngine().run([], 1.0) == []


def test_instruction_sets_follow_from_what_the_processor_says() -> None:
    everything = frozenset[str]().union(*(one.needs for one in SETS))
    told = f"processor : 0\nflags : {' '.join(everything)}\n"
    assert available(told, "x86_64") == (*SETS, PLAIN)
    assert available(told, "aarch64") == (PLAIN,)
    assert available(told.replace("avx512dq", ""), "x86_64") == (*SETS[1:], PLAIN)
    assert available("", "x86_64") == (PLAIN,)


def test_the_layout_is_that_of_the_header() -> None:
    found = layout.layout(LANES)
    assert found.block["parameters"].fields is not None
    assert found.common.itemsize % 8 == 0
    assert found.block.itemsize > 100 * 8 * LANES
    names = [name for name in found.structures if name.startswith("lanes_")]
    assert names == [
        *("lanes_common", "lanes_row", "lanes_observer", "lanes_parameters", "lanes_state", "lanes_block")
    ]
