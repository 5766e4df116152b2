"""The lock is whole, and `make` installs exactly what it names: any pip, any newer versions in the index."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from typing import TYPE_CHECKING

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.install.stub_index import NEWER, needs, pins, write_index
from tests.installed import ROOT, environment

if TYPE_CHECKING:
    from pathlib import Path

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
RUN, DEV = LOCKS = ("requirements.txt", "requirements-dev.txt")
PIPS = {"22.3": DEV, "23.2": RUN, "24.0": RUN, "newest": DEV}  # each with the lock that it installs
if sys.version_info >= (3, 12):
    del PIPS["22.3"]  # it imports what Python 3.12 no longer has
OLD = "INSTALL=$(PIP) install --require-hashes --only-binary :all: -r"  # what a newer coverage broke once


def _markers(python: str) -> dict[str, str]:
    return {"python_version": python, "python_full_version": f"{python}.0", "extra": ""}


def _declared() -> list[Requirement]:
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)
    tables = project["project"]["optional-dependencies"].values()
    lines = [
        *project["project"]["dependencies"],
        *(line for table in tables for line in table),
        *project["dependency-groups"]["build"],
    ]
    return [Requirement(line) for line in lines]


def test_lock_meets_what_the_project_declares() -> None:
    pinned = {canonicalize_name(pin.requirement.name): pin.version for pin in pins(ROOT / DEV)}
    wrong = [
        str(requirement)
        for requirement in _declared()
        if not requirement.specifier.contains(pinned.get(canonicalize_name(requirement.name), "0"))
    ]
    assert wrong == []


@pytest.mark.parametrize("python", PYTHONS)
@pytest.mark.parametrize("lock", LOCKS)
def test_lock_holds_every_requirement_of_its_packages(lock: str, python: str) -> None:
    """What pip would have looked for by itself; it is told not to look."""
    held = {
        canonicalize_name(pin.requirement.name): pin
        for pin in pins(ROOT / lock)
        if pin.requirement.marker is None or pin.requirement.marker.evaluate(_markers(python))
    }
    assert len(held) > 30
    missing = []
    for name, pin in held.items():
        extras = {"", *pin.requirement.extras}
        for line in needs(name):
            need = Requirement(line)
            wanted = need.marker is None or any(
                need.marker.evaluate({**_markers(python), "extra": extra}) for extra in extras
            )
            found = held.get(canonicalize_name(need.name))
            if wanted and (found is None or not need.specifier.contains(found.version, prereleases=True)):
                missing.append(f"{name} needs {line}")
    assert missing == []


def test_every_part_of_the_lock_has_a_hash() -> None:
    for lock in LOCKS:
        text = (ROOT / lock).read_text()
        assert text.count("--hash=sha256:") >= len(pins(ROOT / lock)) > 30


# ---------------------------------------------------------------- make, beside an index that has moved on


def _pip(version: str, folder: Path) -> Path:
    """Create an environment with this version of pip; return its folder."""
    venv = folder / "venv"
    subprocess.run([sys.executable, "-m", "venv", str(venv)], check=True, capture_output=True)
    wanted = ["--upgrade", "pip"] if version == "newest" else [f"pip=={version}"]
    command = [str(venv / "bin" / "python"), "-m", "pip", "-q", "install", *wanted]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        reason = f"pip {version} cannot be had: {done.stderr.strip().splitlines()[-1:]}"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    return venv


def _make(
    folder: Path, venv: Path, lock: str, index: Path, *settings: str
) -> subprocess.CompletedProcess[str]:
    """Run the rule that installs the lock, in a copy of what it reads, against that index alone."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, folder)
    for name in LOCKS:
        shutil.copy(index / name, folder)
    alone = {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": str(index), "PIP_DISABLE_PIP_VERSION_CHECK": "1"}
    command = [
        "make",
        f"VENV={venv}",
        "EDITABLE=true",
        *settings,
        f"{venv}/.installed-{'dev' if lock == DEV else 'run'}",
    ]
    return subprocess.run(
        command, cwd=folder, env=environment(**alone), capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("index")
    for lock in LOCKS:
        write_index(ROOT / lock, folder)
    return folder


def _installed(venv: Path) -> dict[str, str]:
    return {
        canonicalize_name(path.name.split("-")[0]): path.name.split("-")[1].removesuffix(".dist")
        for path in venv.glob("lib/python*/site-packages/*.dist-info")
    }


@pytest.mark.parametrize(("version", "lock"), PIPS.items())
def test_make_installs_what_the_lock_names(version: str, lock: str, tmp_path: Path, index: Path) -> None:
    venv = _pip(version, tmp_path)
    done = _make(tmp_path, venv, lock, index)
    assert done.returncode == 0, done.stdout + done.stderr
    installed = _installed(venv)
    assert NEWER not in installed.values()
    for pin in pins(ROOT / lock):
        if pin.requirement.marker is None or pin.requirement.marker.evaluate():
            assert installed[canonicalize_name(pin.requirement.name)] == pin.version


def test_index_that_has_moved_on_is_noticed(tmp_path: Path, index: Path) -> None:
    """The rule as it was, with a lock whose extras are stripped, fails against this index."""
    stripped = tmp_path / "index"
    shutil.copytree(index, stripped)
    path = stripped / DEV
    path.write_text(path.read_text().replace("coverage[toml]==", "coverage=="))
    venv = _pip("23.2", tmp_path)
    done = _make(tmp_path, venv, DEV, stripped, OLD)
    assert done.returncode != 0
    assert "coverage" in done.stdout + done.stderr
