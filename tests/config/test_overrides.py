"""Overrides: the same as an edit of the file, place and all."""

from pathlib import Path

import pytest

from dcmp_hil.config import load_rig
from dcmp_hil.errors import ConfigError


def fault(source: str, *overrides: str) -> str:
    with pytest.raises(ConfigError) as caught:
        load_rig(source, overrides)
    return str(caught.value)


def file(folder: Path, text: str, name: str = "mine.toml") -> str:
    path = folder / name
    path.write_text(text)
    return str(path)


def test_override_equals_edited_file(tmp_path: Path) -> None:
    path = file(tmp_path, "[loop]\nrate_hz = 500\n[sim.plant]\nku_rad_s2_V = 6.0\n", "bench-1khz.toml")
    edited = load_rig(path)
    overridden = load_rig("bench-1khz", ["loop.rate_hz=500", "sim.plant.ku_rad_s2_V=6.0"])
    assert edited.model_dump() == overridden.model_dump()
    assert overridden.plant.ku == 6.0
    assert overridden.model.values().ku == 5.4


def test_override_of_kind_drops_keys_of_old_kind_but_not_given_ones() -> None:
    assert load_rig("bench-1khz", ["reference.kind=hold"]).reference.kind == "hold"
    assert load_rig("paper", ["observer.kind=super_twisting"]).observer.kind == "super_twisting"
    assert "amplitude_rad" in fault("bench-1khz", "reference.kind=hold", "reference.amplitude_rad=1")


def test_override_keeps_typo_of_file_when_kind_changes(tmp_path: Path) -> None:
    path = file(tmp_path, '[reference]\nkind = "sine"\namplitude_rad = 1.0\ntypo = 1\n')
    text = fault(path, "reference.kind=hold")
    assert "reference.typo" in text
    assert "amplitude_rad" not in text


def test_override_keeps_keys_of_file_when_kind_comes_back() -> None:
    rig = load_rig("bench-1khz", ["reference.kind=hold", "reference.kind=sine"])
    assert rig.model_dump() == load_rig("bench-1khz").model_dump()


def test_override_takes_no_second_key_when_value_has_a_line_break() -> None:
    assert "--set loop.rate_hz" in fault("bench-1khz", "loop.rate_hz=500\nx = 3")


def test_override_lists_every_fault_when_several_are_malformed() -> None:
    lines = fault("bench-1khz", "foo", "=3", "loop.rate_hz.x=1", "loop.=5").splitlines()
    assert len(lines) == 4
    assert all(line.startswith("--set ") for line in lines)


def test_reference_file_starts_from_current_folder_when_overridden(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here/way.csv").write_text("time_s,position_rad\n0,0\n1,1\n")
    path = file(tmp_path, '[reference]\nkind = "csv"\nfile = "nope.csv"\n')
    monkeypatch.chdir(tmp_path / "here")
    for source in (path, "bench-1khz"):
        assert (
            load_rig(source, ["reference.kind=csv", "reference.file=way.csv"]).reference.at(1.0).position
            == 1.0
        )
