"""A sweep's file: what it may say, what is wrong with it in words, and which run has which values."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import pytest

from dcmp_hil import ConfigError, load_rig
from dcmp_hil.config.load import change_rig
from dcmp_hil.config.toml_text import parse_value
from dcmp_hil.sweeping.design import SweepDesign, override
from dcmp_hil.sweeping.preparation import prepare
from dcmp_hil.sweeping.schema import sweep_schema
from dcmp_hil.sweeping.spec_file import load_spec, spec_from
from dcmp_hil.sweeping.variants import Refusal, variants
from tests.sweeping.specs import SMALL, spec
from tools.schema import SWEEP_SCHEMA, sweep_schema_text

if TYPE_CHECKING:
    from dcmp_hil.sweeping.spec import Scalar

EXAMPLE = Path(__file__).parents[2] / "examples/friction_sweep.toml"
F1 = "model.f1_rad_s2"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"runz": 3}, "spec, runz: unknown key. Did you mean runs?"),
        ({"grid": {F1: []}}, "spec, grid.model.f1_rad_s2: an empty range: got []. Write at least one value."),
        ({"grid": {F1: {"from": 1, "to": 1, "steps": 3}}}, "an empty range: from and to are the same."),
        ({"grid": {F1: {"from": 1, "to": 2, "steps": 0}}}, "an empty range: got steps = 0."),
        ({"grid": {F1: {"form": 1, "to": 2}}}, 'unknown key "form". Did you mean from?'),
        ({"grid": {"model": {"f1_rad_s2": {"unit": 1}}}}, "model.f1_rad_s2.unit: got 1; expected a list"),
        ({"grid": {F1: {"from": -1, "to": 2, "steps": 3, "scale": "log"}}}, "needs both ends above 0"),
        ({"draw": {F1: {"uniform": [2, 1]}}}, "an empty range: write the lower end first"),
        ({"draw": {F1: {"unifrom": [1, 2]}}}, 'unknown key "unifrom". Did you mean uniform?'),
        ({"draw": {F1: {"normal": [1, 0]}}}, "normal needs a standard deviation above 0"),
        ({"draw": {"loop.delay_samples": {"choice": [0, 1]}}}, "it is in [draw], too. Remove one."),
        ({"duration_s": "10s"}, 'spec, duration_s: got "10s"; expected a number'),
        ({"grid": 3}, "spec, grid: got 3; expected a table of keys of the rig."),
    ],
)
def test_a_wrong_spec_is_one_sentence_with_the_remedy(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError) as caught:
        spec(**changes)
    (fault,) = caught.value.faults
    assert sentence in fault


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"grid": {"model.f1_rads2": [1.0]}},
            "[grid], model.f1_rads2: unknown key. Did you mean f1_rad_s2?",
        ),
        ({"grid": {F1: [1.0, -1.0]}}, "spec [grid], model.f1_rad_s2: got -1; expected a number, at least 0"),
        ({"draw": {F1: {"uniform": [1.0, 1e6]}}}, "spec [draw], model.f1_rad_s2: got"),
        ({"set": {"supervisor.strat": "x"}}, "spec, set.supervisor.strat: unknown key. Did you mean start?"),
        ({"rig": "bench-2khz"}, "is no shipped rig"),
        (
            {"rig": "bench-serial", "set": {"backend.port": "/dev/null"}},
            "real device. Sweep a simulated rig",
        ),
        (
            {"grid": {"controller.kp_1_s2": [1e6]}},
            "no run of the sweep is possible; the first: controller.kp",
        ),
        ({"faults": ["plant.shave:at=1s"]}, "plant.shove"),
    ],
)
def test_a_spec_that_does_not_fit_the_rig_is_refused_before_anything_starts(
    changes: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(ConfigError, match=r".") as caught:
        prepare(spec(**changes), "spec")
    assert sentence in str(caught.value)


def test_keys_may_be_dotted_or_tables_in_tables() -> None:
    dotted = spec_from({**SMALL, "grid": {"sim.plant.f0_1_s": [0.1, 0.2]}}, "spec")
    assert dotted == spec_from({**SMALL, "grid": {"sim": {"plant": {"f0_1_s": [0.1, 0.2]}}}}, "spec")


def test_ranges_meet_their_ends_to_the_bit() -> None:
    ranges = {"from": 0.1, "to": 0.7, "steps": 7}, {"from": 1, "to": 8, "steps": 4, "scale": "log"}
    linear, log = spec(grid=dict(zip((F1, "model.f0_1_s"), ranges, strict=True))).axes
    assert (linear[0], linear[-1], len(linear)) == (0.1, 0.7, 7)
    assert log == pytest.approx([1, 2, 4, 8])


def test_every_point_of_a_grid_sees_the_same_draws_and_no_key_moves_those_of_another() -> None:
    design = SweepDesign(spec())
    rows = [design.values(run) for run in range(6)]
    assert [row[0] for row in rows] == [0, 0, 0, 1, 1, 1]
    assert [row[1:] for row in rows[:3]] == [row[1:] for row in rows[3:]]
    more = SweepDesign(spec(runs=50, draw={"model.f0_1_s": {"uniform": [0.1, 0.2]}, **SMALL["draw"]}))
    assert [more.named(run)["sim.plant.f1_rad_s2"] for run in range(3)] == [row[1] for row in rows[:3]]
    assert len({more.named(run)["sim.seed"] for run in range(50)}) == 50
    assert SweepDesign(spec(seed=2)).values(0)[1] != rows[0][1]


def test_draws_have_the_distribution_that_is_asked_for() -> None:
    design = SweepDesign(
        spec(
            runs=4000,
            grid={},
            draw={
                "a": {"uniform": [1.0, 3.0]},
                "b": {"loguniform": [0.1, 10.0]},
                "c": {"normal": [5.0, 2.0]},
                "d": {"choice": ["x", "y"]},
            },
        )
    )
    rows = [design.values(run) for run in range(4000)]
    a, b, c = ([float(row[k]) for row in rows] for k in range(3))
    assert 1.0 <= min(a) < 1.01
    assert 2.99 < max(a) < 3.0
    assert sum(map(math.log, b)) / len(b) == pytest.approx(0.0, abs=0.08)
    assert (sum(c) / len(c), sum((x - 5.0) ** 2 for x in c) / len(c)) == pytest.approx((5.0, 4.0), abs=0.3)
    assert [row[3] for row in rows].count("x") == pytest.approx(2000, abs=150)


@pytest.mark.parametrize("value", [0.1, 1e-7, 1e22, 3, True, "sine", "0.5", "true", "a b", 'quo"te', -2.5])
def test_an_override_reads_back_as_the_same_value(value: float | str) -> None:
    key, _, text = override("reference.kind", value).partition("=")
    back = parse_value(text)
    assert (key, type(back), back) == ("reference.kind", type(value), value)


def test_variants_are_the_rigs_that_load_rig_makes() -> None:
    base = load_rig("bench-1khz", ["supervisor.start=immediate"])
    runs: list[dict[str, Scalar]] = [
        {"controller.kp_1_s2": 5000.0, "sim.plant.f1_rad_s2": 2.0},
        {"observer.kind": "kalman"},
        {"controller.kp_1_s2": 900000.0},
        {"model.f1_rad_s2": -1.0},
        {"sim.step_us": 333.0},
    ]
    found = variants(base, runs)
    for made, values in zip(found, runs, strict=True):
        overrides = [override(*one) for one in values.items()]
        if isinstance(made, Refusal):
            with pytest.raises(ConfigError) as caught:
                change_rig(base, overrides)
            assert str(made) in str(caught.value)
        else:
            assert made == change_rig(base, overrides)
    assert [isinstance(made, Refusal) for made in found] == [False, False, True, True, True]


def test_schema_is_what_the_code_says_and_takes_the_example() -> None:
    assert SWEEP_SCHEMA.read_text("utf-8") == sweep_schema_text(), "run: python -m tools.schema"
    validator = jsonschema.Draft202012Validator(sweep_schema())
    validator.check_schema(sweep_schema())
    table = tomllib.loads(EXAMPLE.read_text("utf-8"))
    validator.validate(table)
    validator.validate(SMALL)
    assert not validator.is_valid({**table, "runz": 1})
    assert load_spec(EXAMPLE).total == 100
