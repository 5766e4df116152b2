"""uPlot as it was released, once in the tree, with its licence, and in an installed wheel."""

from __future__ import annotations

import hashlib
import subprocess
from pathlib import Path

import dcmp_hil

_UPLOT = Path("vendor") / "uplot"
_SHA256 = {
    "uPlot.iife.min.js": "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f",
    "uPlot.min.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
}


def _hashes(folder: Path) -> dict[str, str]:
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in _SHA256}


def test_uplot_is_what_was_released_and_names_version_and_licence() -> None:
    package = Path(dcmp_hil.__file__).parent
    assert _hashes(package / _UPLOT) == _SHA256
    assert "MIT License" in (package / _UPLOT / "LICENSE").read_text("utf-8")
    version = (package / _UPLOT / "uPlot.iife.min.js").read_text("utf-8").partition("(v")[2].partition(")")[0]
    assert f"| {version} |" in (package / "vendor" / "README.md").read_text("utf-8")
    others = [file for file in package.rglob("*.js") if "uPlot=function" in file.read_text("utf-8")]
    assert len(others) == 1


def test_an_installed_wheel_has_uplot_and_the_page(installed: Path) -> None:
    code = "import dcmp_hil, pathlib; print(pathlib.Path(dcmp_hil.__file__).parent)"
    command = [str(installed.parent / "python"), "-I", "-c", code]
    found = subprocess.run(command, capture_output=True, text=True, check=True, cwd=installed.parent)
    package = Path(found.stdout.strip())
    assert package != Path(dcmp_hil.__file__).parent
    assert _hashes(package / _UPLOT) == _SHA256
    assert (package / _UPLOT / "LICENSE").exists()
    here = Path(dcmp_hil.__file__).parent / "panel" / "page"
    assert {one.name for one in (package / "panel" / "page").iterdir()} == {
        one.name for one in here.iterdir()
    }
