"""Classes that a rig names: where they are found."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig
from dcmp_hil.assembly import make_observer
from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.named_class import find_named
from dcmp_hil.plugins.roles import OBSERVER
from dcmp_hil.plugins.static_check import look_at
from dcmp_hil.values import Sample
from tests.plugins.observer_text import OBSERVER_TEXT

if TYPE_CHECKING:
    from pathlib import Path


def test_find_named_imports_the_class() -> None:
    assert find_named("dcmp_hil.values:Sample", "observer.kind") is Sample


@pytest.mark.parametrize(
    ("path", "says"),
    [
        ("simm", 'Did you mean "sim"'),
        ("nothing_like_it", "sim, board"),
        ("no_such_module_anywhere:Class", "no_such_module_anywhere failed"),
        ("dcmp_hil.values:Sampel", "Did you mean Sample"),
        ("dcmp_hil.values:zzzzzzz", "has no class zzzzzzz"),
        ("dcmp_hil.values:", "has no class"),
        ("dcmp_hil.values:UNKNOWN_TRUTH", "has no class"),
        (":Class", "kind"),
        (".values:Sample", "kind"),
        ("dcmp_hil..values:Sample", "kind"),
        ("dcmp_hil.values.Sample:Sample", "kind"),
        ("", "kind"),
    ],
)
def test_find_named_explains_what_is_wrong(path: str, says: str) -> None:
    with pytest.raises(ConfigError, match=r"backend\.kind") as caught:
        find_named(path, "backend.kind", ("sim", "board"))
    assert says in str(caught.value)


# ---------------------------------------------------------------- where it is looked for


def test_module_beside_the_rig_is_found_and_its_folder_is_not_searched_for_others(
    tmp_path: Path, module: str
) -> None:
    (tmp_path / f"{module}.py").write_text(OBSERVER_TEXT)
    before = list(sys.path)
    made = find_named(f"{module}:Obs", "observer.kind", folders=[tmp_path])
    assert made.__module__ == module
    assert sys.path == before
    assert find_named(f"{module}:Obs", "observer.kind", folders=[tmp_path]) is made


@pytest.mark.parametrize("with_init", [True, False])
def test_module_of_a_package_beside_the_rig_is_found(tmp_path: Path, module: str, with_init: bool) -> None:
    package = tmp_path / module
    package.mkdir()
    if with_init:
        (package / "__init__.py").write_text("")
    (package / "gains.py").write_text("GAIN = 7.0\n")
    (package / "mine.py").write_text(f"from .gains import GAIN\n{OBSERVER_TEXT}")
    look_at(f"{module}.mine:Obs", OBSERVER, [tmp_path])
    assert module not in sys.modules
    assert find_named(f"{module}.mine:Obs", "observer.kind", folders=[tmp_path]).__name__ == "Obs"


def test_rig_file_finds_its_class_from_any_folder(
    tmp_path: Path, module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab, elsewhere = tmp_path / "lab", tmp_path / "elsewhere"
    lab.mkdir()
    elsewhere.mkdir()
    (lab / f"{module}.py").write_text(OBSERVER_TEXT)
    (lab / "rig.toml").write_text(f'[observer]\nkind = "{module}:Obs"\noptions.gain = 3.0\n')
    monkeypatch.chdir(tmp_path)
    rig = load_rig("lab/rig.toml")
    monkeypatch.chdir(elsewhere)
    observer = make_observer(rig)
    assert observer.inner.gain == 3.0  # type: ignore[attr-defined]


def test_library_is_never_replaced_by_a_file_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "json.py").write_text(OBSERVER_TEXT)
    for refuse in (find_named, lambda *_, folders: look_at("json:Obs", OBSERVER, folders)):
        with pytest.raises(ConfigError, match=r"json is there twice: .*json.*__init__\.py and .*json\.py"):
            refuse("json:Obs", "observer.kind", folders=[tmp_path])
    import json

    assert json.loads("1") == 1


def test_name_in_both_folders_is_refused(tmp_path: Path, module: str) -> None:
    for folder in ("rig", "here"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / f"{module}.py").write_text(OBSERVER_TEXT)
    folders = [tmp_path / "rig", tmp_path / "here"]
    with pytest.raises(ConfigError, match=r"twice: .*rig.*\.py and .*here.*\.py"):
        find_named(f"{module}:Obs", "observer.kind", folders=folders)
    find_named(f"{module}:Obs", "observer.kind", folders=folders[:1])
    with pytest.raises(ConfigError, match="twice"):  # it is loaded from the other one
        find_named(f"{module}:Obs", "observer.kind", folders=folders[1:])


def test_checkout_of_this_program_in_the_current_folder_is_no_second_one(tmp_path: Path) -> None:
    (tmp_path / "dcmp_hil").mkdir()
    (tmp_path / "dcmp_hil" / "__init__.py").write_text("1 / 0\n")
    assert find_named("dcmp_hil.values:Sample", "observer.kind", folders=[tmp_path]) is Sample


def test_folder_of_data_with_the_name_of_the_module_is_no_second_one(tmp_path: Path, module: str) -> None:
    (tmp_path / "rig").mkdir()
    (tmp_path / "rig" / f"{module}.py").write_text(OBSERVER_TEXT)
    (tmp_path / module).mkdir()
    (tmp_path / module / "run.csv").write_text("1,2\n")
    find_named(f"{module}:Obs", "observer.kind", folders=[tmp_path / "rig", tmp_path])


def test_module_that_lies_beside_a_plug_in_is_named_with_what_helps(tmp_path: Path, module: str) -> None:
    (tmp_path / "gains_beside.py").write_text("GAIN = 7.0\n")
    (tmp_path / f"{module}.py").write_text("\nimport gains_beside\n")
    with pytest.raises(
        ConfigError, match=rf"{module}\.py, line 2.*gains_beside lies beside it.*__init__\.py"
    ):
        find_named(f"{module}:Obs", "observer.kind", folders=[tmp_path])
    assert module not in sys.modules
