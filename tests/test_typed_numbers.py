"""No typed number makes the simulated arm leave its limits: a sample of what `make numbers` draws."""

from __future__ import annotations

import json
import random
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.config import load_rig
from dcmp_hil.config.explain import warnings
from dcmp_hil.errors import ConfigError
from dcmp_hil.live.tunables import changed, doubts
from tests.helpers import bench
from tools.typed_numbers import Typed, draw, judge

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.installed import Finished

pytestmark = pytest.mark.untraced


def test_random_numbers_leave_no_arm_beyond_its_limits() -> None:
    rng = random.Random(7)
    judged = [(typed, judge(typed)) for typed in (draw(rng) for _ in range(60))]
    assert not [(typed, outcome) for typed, outcome in judged if outcome.bad]
    assert sum(outcome.accepted for _, outcome in judged) >= 20


@pytest.mark.parametrize(
    ("kinds", "override"),
    [  # each left its limits, or hit them hard, before
        ((), "reference.amplitude_rad=7.0"),
        ((), "reference.amplitude_rad=200.0"),
        ((), "reference.offset_rad=7.85"),
        (("observer.kind=paper",), "reference.offset_rad=7.85"),
        (("reference.kind=step", "reference.at_s=1.5"), "reference.after_rad=-5.9"),
        (("reference.kind=hold", "reference.soft_start_s=0.0"), "reference.position_rad=6.0"),
        ((), "model.ku_rad_s2_V=10000.0"),
    ],
)
def test_number_that_once_led_beyond_a_limit_does_so_no_more(kinds: tuple[str, ...], override: str) -> None:
    outcome = judge(Typed(kinds, override, None))
    assert outcome.accepted, outcome
    assert not outcome.bad


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("reference.amplitude_rad=200", "leaves supervisor.position_limit_rad and will be held at 5.969 rad"),
        ("reference.rate_rad_s=100", "asks for 100 rad/s"),
        ("reference.rate_rad_s=10", "asks for 100 rad/s2, more than the motor can follow"),
        ("reference.offset_rad=-6", "leaves supervisor.position_limit_rad"),
    ],
)
def test_reference_beyond_reach_is_a_warning_of_run_and_a_refusal_of_set(override: str, words: str) -> None:
    assert any(words in sentence for sentence in warnings(load_rig("bench-1khz", [override])))
    with pytest.raises(ConfigError, match=words):
        changed(bench(), [override])


def test_set_says_the_warnings_that_run_says() -> None:
    before = bench()
    after, _ = changed(before, ["observer.mu0_rad_s=13"])
    assert doubts(before, after) == warnings(after)
    assert doubts(after, after) == []


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("supervisor.position_limit_rad=0.1", "at least 0.2 rad"),
        ("supervisor.velocity_limit_rad_s=0.5", "at least 2 rad/s"),
        ("model.eta_rad_s2=500", "nothing would hold the arm"),
    ],
)
def test_limits_that_the_start_alone_would_pass_are_refused(override: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        load_rig("bench-1khz", [override])


def test_run_beyond_reach_ends_well_and_says_what_was_limited(
    script: Callable[..., Finished], tmp_path: Path
) -> None:
    done = script(
        "run", "--fast", "--duration", "6", "--viewer", "none", "--json", "figures.json",
        "--set", "reference.amplitude_rad=200", "--set", "sim.plant.ku_rad_s2_V=9.99", cwd=tmp_path,
    )  # fmt: skip
    said = " ".join(done.err.split())
    assert done.code == 0, done.err
    assert "Traceback" not in done.err
    assert "will be held at 5.969 rad" in said
    assert "times [model]'s 5.4" in said
    figures = json.loads((tmp_path / "figures.json").read_text("utf-8"))
    assert figures["ended_by"] == "duration"
    assert figures["motor_gain"]["model_rad_s2_V"] == 5.4
    assert figures["motor_gain"]["ratio"] == pytest.approx(1.85, rel=0.1)
    (folder,) = (tmp_path / "runs").iterdir()
    assert (folder / "run.mcap").stat().st_size > 0
    assert not (folder / "black_box.csv").exists()
