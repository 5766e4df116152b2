"""Values of a run for its rig file: a diff, written once accepted, only over what it was made from."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.config import copy_rig, load_rig
from dcmp_hil.errors import ConfigError
from dcmp_hil.live.start_values import overrides_between, table_overrides, tunable_overrides
from dcmp_hil.live.tunables import changed, settable, value_of
from dcmp_hil.panel.rig_file import RigFiles
from tests.helpers import bench

if TYPE_CHECKING:
    from pathlib import Path

_CHANGES = ["controller.kp_1_s2=5200", "observer.mu0_rad_s=35", "reference.amplitude_rad=0.6"]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "ours.toml"
    copy_rig("bench-1khz", path)
    return path


def _values(*changes: str) -> list[str]:
    return tunable_overrides(changed(bench(), changes)[0] if changes else bench())


def test_an_accepted_diff_is_written_with_every_comment(file: Path) -> None:
    before = file.read_text("utf-8")
    files = RigFiles()
    proposed = files.propose(str(file), _values(*_CHANGES))
    assert file.read_text("utf-8") == before
    signs = [line for line in proposed["diff"].splitlines()[2:] if line[0] in "+-"]
    assert signs == [
        "+mu0_rad_s = 35",
        "-kp_1_s2 = 4000.0                    # 1/s2",
        "+kp_1_s2 = 5200                      # 1/s2",
        "-amplitude_rad = 1.0                 # rad",
        "+amplitude_rad = 0.6                 # rad",
    ]
    assert files.accept(proposed["proposal"]) == str(file)
    rig = load_rig(file)
    assert [value_of(rig, one.partition("=")[0]) for one in _CHANGES] == [5200.0, 35.0, 0.6]
    assert file.read_text("utf-8").count("#") == before.count("#")
    assert sorted(one.name for one in file.parent.iterdir()) == ["ours.toml", "rig.schema.json"]
    assert RigFiles().propose(str(file), _values(*_CHANGES)) == {}
    with pytest.raises(ConfigError, match="no longer known"):
        files.accept(proposed["proposal"])


def test_a_file_that_was_changed_meanwhile_is_not_written(file: Path) -> None:
    files = RigFiles()
    number = files.propose(str(file), _values(*_CHANGES))["proposal"]
    edited = file.read_text("utf-8") + "# a word of mine\n"
    file.write_text(edited, "utf-8")
    with pytest.raises(ConfigError, match="changed meanwhile"):
        files.accept(number)
    assert file.read_text("utf-8") == edited
    number = files.propose(str(file), _values(*_CHANGES))["proposal"]
    file.unlink()
    with pytest.raises(ConfigError, match="Nothing is written"):
        files.accept(number)
    assert not file.exists()


def test_another_kind_of_reference_is_written_with_its_keys(file: Path) -> None:
    files = RigFiles()
    changes = ['reference.kind="trapezoid"', "reference.rest_s=1.5"]
    files.accept(files.propose(str(file), _values(*changes))["proposal"])
    after = changed(bench(), changes)[0]
    rig = load_rig(file)
    assert rig.reference.kind == "trapezoid"
    for key in settable(after):
        assert value_of(rig, key) == value_of(after, key)


def test_what_a_rule_works_out_for_a_run_is_not_fixed_in_its_file(file: Path) -> None:
    run = bench("loop.rate_hz=500")
    mu0 = value_of(run, "observer.mu0_rad_s")
    assert mu0 != value_of(bench(), "observer.mu0_rad_s")
    assert RigFiles().propose(str(file), tunable_overrides(run), table_overrides(run)) == {}
    run = changed(run, ["observer.mu0_rad_s=35"])[0]
    proposed = RigFiles().propose(str(file), tunable_overrides(run), table_overrides(run))
    assert [line for line in proposed["diff"].splitlines()[2:] if line[0] in "+-"] == ["+mu0_rad_s = 35"]
    assert overrides_between(run, bench("loop.rate_hz=500")) == [f"observer.mu0_rad_s={mu0!r}"]


@pytest.mark.parametrize(
    "given",
    [
        ["observer.kind=friction_kalman", "observer.f1_uncertainty=0.5", "observer.d_noise=0.2"],
        ["observer.kind=paper", "observer.M_rad_s3=500.0", "observer.start=zero"],
        ["observer.kind=kalman"],
    ],
)
def test_a_kind_that_the_file_does_not_have_is_written_with_all_that_the_run_states(
    file: Path, given: list[str]
) -> None:
    run = bench(*given)
    files = RigFiles()
    files.accept(files.propose(str(file), tunable_overrides(run), table_overrides(run))["proposal"])
    assert load_rig(file).observer == run.observer
    assert load_rig(file).controller == run.controller
    command = files.propose("bench-1khz", tunable_overrides(run), table_overrides(run))["command"]
    overrides = shlex.split(command)[4::2]
    assert bench(*overrides).observer == run.observer


def test_a_shipped_rig_has_a_command_instead(file: Path) -> None:
    found = RigFiles().propose("bench-1khz", _values(*_CHANGES, 'controller.kind="pd"'))
    assert found["command"].startswith("dcmp-hil run bench-1khz --set 'controller.kind=\"pd\"' --set ")
    assert "--set reference.amplitude_rad=0.6" in found["command"]
    assert RigFiles().propose("bench-1khz", _values()) == {}
    assert file.exists()


def test_values_that_break_a_rule_of_the_file_and_layouts_are_refused(file: Path) -> None:
    text = file.read_text("utf-8")
    file.write_text(text.replace("rate_hz = 1000 ", "rate_hz = 100 "), "utf-8")
    with pytest.raises(ConfigError, match=r"stable|fast"):
        RigFiles().propose(str(file), _values("observer.mu0_rad_s=45"))
    file.write_text("name = 'ours'\ncontroller = {kp_1_s2 = 4000.0}\n", "utf-8")
    with pytest.raises(ConfigError, match="cannot be edited here"):
        RigFiles().propose(str(file), _values(*_CHANGES))


def test_only_the_newest_diffs_are_kept(file: Path) -> None:
    files = RigFiles()
    numbers = [files.propose(str(file), _values(*_CHANGES))["proposal"] for _ in range(10)]
    with pytest.raises(ConfigError, match="no longer known"):
        files.accept(numbers[0])
    files.accept(numbers[-1])


def test_the_way_back_leads_to_every_value_of_the_start() -> None:
    start = bench()
    now = changed(start, [*_CHANGES, 'controller.kind="pd"'])[0]
    now = changed(now, ['reference.kind="hold"'])[0]
    back = overrides_between(now, start)
    again = changed(now, back)[0]
    assert {key: value_of(again, key) for key in settable(start)} == {
        key: value_of(start, key) for key in settable(start)
    }
    assert overrides_between(start, again) == overrides_between(again, start) == []
