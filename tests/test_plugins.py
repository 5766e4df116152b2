"""Names in rig.toml to classes, with a message for everything that can be wrong."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins import find_named
from dcmp_hil.values import Sample

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


def test_find_named_says_what_a_module_lacks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "module_with_missing_import.py").write_text("import not_installed_anywhere\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ConfigError, match="not_installed_anywhere"):
        find_named("module_with_missing_import:Class", "observer.kind")


def test_find_named_lets_a_users_own_mistake_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # A fault inside the user's module is his to see whole, traceback and all.
    (tmp_path / "module_with_mistake.py").write_text("1 / 0\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ZeroDivisionError):
        find_named("module_with_mistake:Class", "observer.kind")
