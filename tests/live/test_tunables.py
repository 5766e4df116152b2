"""What may change in a run: the words of rig.toml, and no limit ever."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated

import pytest
from pydantic import Field

from dcmp_hil.common.section import NotNegative, Positive, Section
from dcmp_hil.config.rig import Rig
from dcmp_hil.config.rules import within_reason
from dcmp_hil.control.model import Model
from dcmp_hil.errors import ConfigError
from dcmp_hil.live.tunable_ranges import slider_range, tunable_descriptions
from dcmp_hil.live.tunables import changed, settable
from tests.helpers import bench, named

if TYPE_CHECKING:
    from pathlib import Path

_SAFE = {"controller", "observer", "reference"}


def test_no_limit_and_no_safety_key_is_settable() -> None:
    assert {key.partition(".")[0] for key in settable(bench())} == _SAFE
    for name, field in Rig.model_fields.items():
        if name in _SAFE or not hasattr(field.annotation, "model_fields"):
            continue
        for key in field.annotation.model_fields:  # type: ignore[union-attr]
            with pytest.raises(ConfigError, match="cannot be changed in a run"):
                changed(bench(), [f"{name}.{key}=1"])


@pytest.mark.parametrize(
    ("override", "why"),
    [
        ("controler.kp_1_s2=1", "Did you mean controller"),
        ("controller.kpp_1_s2=1", "Did you mean kp_1_s2"),
        ("controller.kp_1_s2=fast", "expected a number"),
        ("controller.kp_1_s2=1e12", "at most 1000000000"),
        ("reference.amplitude_deg=30", "amplitude_rad = 0.5235"),
        ("reference.soft_start_s=0", "cannot be changed in a run"),
        ("controller.position=measured", "cannot be changed in a run"),
        ("controller.friction_feedforward=true", "cannot be changed in a run"),
        ("controller.kind=mine:Mine", "class of your own"),
        ("observer.kind=paper", "cannot be changed in a run"),
        ("reference.kind=csv", "file"),
        ("reference=3", "cannot be changed in a run"),
        ("controller.kp_1_s2", "KEY=VALUE"),
    ],
)
def test_change_is_refused_in_the_words_of_the_rig(override: str, why: str) -> None:
    with pytest.raises(ConfigError, match=why):
        changed(bench(), [override])


def test_every_fault_is_named_at_once() -> None:
    with pytest.raises(ConfigError) as caught:
        changed(bench(), ["controller.kp_1_s2=-1", "reference.rate_rad_s=0"])
    assert len(caught.value.faults) == 2


def test_nothing_is_no_change() -> None:
    with pytest.raises(ConfigError, match="Nothing to change"):
        changed(bench(), [])
    _, change = changed(bench(), ["controller.kp_1_s2=4000"])
    assert not change.values
    assert change[2:5] == (None, None, None)


def test_class_of_your_own_is_not_settable() -> None:
    rig = bench(f"controller.kind={named(Model)}")
    assert not any(key.startswith("controller.") for key in settable(rig))
    with pytest.raises(ConfigError, match="a class of your own"):
        changed(rig, ["controller.kind=pd"])
    assert changed(rig, ["reference.amplitude_rad=0.5"])[1].reference is not None


def test_observer_of_the_paper_is_not_settable() -> None:
    rig = bench("observer.kind=paper")
    assert not any(key.startswith("observer.") for key in settable(rig))
    with pytest.raises(ConfigError, match="cannot be changed"):
        changed(rig, ["observer.M_rad_s3=1"])


def test_reference_of_a_file_gives_way_to_a_sine(tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    file.write_text("time_s,position_rad\n0,0\n1,0.5\n")
    rig = bench("reference.kind=csv", f"reference.file={file}")
    assert changed(rig, ["controller.kp_1_s2=5000"])[1].reference is None
    after, change = changed(rig, ["reference.kind=sine", "reference.amplitude_rad=0.3"])
    assert change.reference == after.reference.source()
    assert "reference.kind" in change.words


@pytest.mark.untraced
@pytest.mark.parametrize("kind", ["sine", "chirp", "hold", "step", "trapezoid"])
def test_knobs_are_what_is_settable_and_within_what_is_allowed(kind: str) -> None:
    rig = bench(f"reference.kind={kind}")
    turned = tunable_descriptions(rig)
    assert [knob["key"] for knob in turned] == settable(rig)
    for knob in turned:
        if "choices" in knob:
            for choice in knob["choices"]:
                changed(rig, [f"{knob['key']}={choice}"])
            continue
        start, end = knob["slider"]
        assert knob["low"] <= start <= knob["value"] <= end <= knob["high"], knob
        assert start > 0.0 or not knob["decades"]
        for value in (start, end, knob["low"], knob["high"]):
            changed(rig, [f"{knob['key']}={value}"])


class _WithoutRows(Section):
    """Keys of a stage of a user, none of which the table of sliders knows."""

    gain_V_rad: NotNegative = 40.0
    time_constant_s: Positive = 0.5
    share: Annotated[float, Field(ge=0, le=1)] = 0.3
    turn_rad: float = 0.2
    drift_rad_s: float = 2.0
    bias_V: float = 0.0


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("gain_V_rad", (0.0, 400.0)),
        ("time_constant_s", (0.05, 5.0)),
        ("share", (0.0, 1.0)),
        ("turn_rad", (-3.0, 3.0)),
        ("drift_rad_s", (-20.0, 20.0)),
        ("bias_V", (-1.0, 1.0)),
    ],
)
def test_slider_of_a_key_without_a_row_follows_its_bounds_and_its_value(
    name: str, expected: tuple[float, float]
) -> None:
    assert slider_range(_WithoutRows, name, getattr(_WithoutRows(), name)) == pytest.approx(expected)


def test_slider_of_the_largest_number_ends_at_a_number() -> None:
    assert slider_range(_WithoutRows, "gain_V_rad", 1e308) == (0.0, sys.float_info.max)


def test_upper_bound_of_a_key_is_the_highest_that_it_may_have() -> None:
    assert within_reason(_WithoutRows, "share") == (0.0, 1.0)
    assert within_reason(_WithoutRows, "time_constant_s") == (1e-6, 1e6)
    assert within_reason(_WithoutRows, "turn_rad") == (-1e4, 1e4)
