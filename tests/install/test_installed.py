"""The script that other tests run is the installed one, not this checkout."""

from collections.abc import Callable
from pathlib import Path

from tests.installed import ROOT, Finished


def test_script_of_the_wheel_runs(script: Callable[..., Finished], tmp_path: Path) -> None:
    done = script("run", "--fast", "--duration", "1", "--no-record", "--json", "figures.json")
    assert (done.code, done.err) == (0, "")
    assert (tmp_path / "figures.json").exists()


def test_script_does_not_import_the_checkout(installed: Path) -> None:
    packages = next(installed.parents[1].glob("lib/python*/site-packages"))
    assert (packages / "dcmp_hil" / "__init__.py").exists()
    assert not installed.is_relative_to(ROOT)
