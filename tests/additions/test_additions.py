"""One of each kind is really added to a copy of the package: it works, and the edits are counted."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.installed import environment

_HERE = Path(__file__).parent
_ROOT = _HERE.parents[1]
_KINDS = "dcmp_hil/config/kinds.py"


class Addition(NamedTuple):
    """What is written by hand to add one thing."""

    files: dict[str, str]  # of the copy, new, to those of this folder
    places: tuple[tuple[str, str, str], ...]  # file; the line before it, or the class behind it; the text
    tests: dict[str, str] = {}  # noqa: RUF012 - never changed


def _line(table: str, path: str) -> tuple[str, str, str]:
    return _KINDS, f"{table} = (\n", f'    "{path}",\n'


_TCP_SETTINGS = '''class TcpSettings(Device):
    """A device behind a TCP port of this computer."""

    factory: ClassVar[str] = "dcmp_hil.device.links.tcp:open_tcp"
    listener: ClassVar[str] = "dcmp_hil.device.links.tcp:listen"
    kind: Literal["tcp"]
    """TCP on 127.0.0.1."""
    tcp_port: Annotated[int, Field(ge=1, le=65_535, examples=[5000])]
    """Number of the port."""


'''
_FAULT = '''class Weak(HostFault):
    """The controller asks for less than it means to."""

    def demand(self, demand: float) -> float:
        """Return the smaller demand, V."""
        return demand * self.number("factor")


'''
_PLANT = '''class PushedPlant(MoreauPlant):
    """An arm that a constant torque pushes."""

    def advance(self, voltage: float) -> Truth:
        """Hold `voltage` and one volt more for one period."""
        return super().advance(voltage + 1.0)


'''
_SIGNAL = '    Signal("asked_V", "control/asked_V", "asked", ERROR_RGB, lambda b: b["voltage_demand"]),\n'
ADDITIONS = {
    "observer": Addition(
        {"dcmp_hil/control/observers/luenberger.py": "luenberger.py"},
        (_line("OBSERVERS", "dcmp_hil.control.observers.luenberger:LuenbergerSettings"),),
    ),
    "controller": Addition(
        {"dcmp_hil/control/controllers/proportional.py": "proportional.py"},
        (_line("CONTROLLERS", "dcmp_hil.control.controllers.proportional:ProportionalSettings"),),
    ),
    "reference": Addition(
        {"dcmp_hil/control/references/approach.py": "ramp.py"},
        (_line("REFERENCES", "dcmp_hil.control.references.approach:Approach"),),
    ),
    "link": Addition(
        {"dcmp_hil/device/links/tcp.py": "tcp.py"},
        (
            ("dcmp_hil/config/backends.py", "class CustomBackend", _TCP_SETTINGS),
            _line("BACKENDS", "dcmp_hil.config.backends:TcpSettings"),
        ),
        {"tests/contract/ports/tcp.py": "tcp_port.py"},
    ),
    "signal and its plot": Addition(
        {},
        (
            (
                "dcmp_hil/telemetry/signals.py",
                "SIGNALS = (\n",
                _SIGNAL,
            ),
        ),
    ),
    "plant": Addition(
        {},
        (
            ("sim_backend/plant.py", "def make_plant", _PLANT),
            (
                "dcmp_hil/config/sections.py",
                '"friction that can stick"),\n',
                '    "pushed": ("sim_backend.plant:PushedPlant", "a constant torque"),\n',
            ),
        ),
    ),
    "fault": Addition(
        {},
        (
            ("sim_backend/faults/host.py", "class Slow", _FAULT),
            (
                "sim_backend/faults/host.py",
                "HOST = {\n",
                '    "host.weak": Kind(Weak, "a weak demand", {"factor": Number("", 0, 1, 0.5)}),\n',
            ),
        ),
    ),
}


def _add(tree: Path, addition: Addition) -> None:
    for name, source in {**addition.files, **addition.tests}.items():
        assert not (tree / name).exists()
        shutil.copy(_HERE / source, tree / name)
    for name, anchor, text in addition.places:
        written = (tree / name).read_text("utf-8")
        assert written.count(anchor) == 1, anchor
        at = written.index(anchor) + (len(anchor) if anchor.endswith("\n") else 0)
        (tree / name).write_text(written[:at] + text + written[at:], "utf-8")


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the packages, with one of each added."""
    tree = tmp_path_factory.mktemp("added")
    for package in ("dcmp_hil", "sim_backend", "tests/contract", "tests/additions"):
        shutil.copytree(_ROOT / package, tree / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("__init__.py", "helpers.py"):
        shutil.copy(_ROOT / "tests" / name, tree / "tests")
    (tree / "firmware").symlink_to(_ROOT / "firmware")
    for addition in ADDITIONS.values():
        _add(tree, addition)
    return tree


@pytest.mark.usefixtures("needs_compiler")
def test_one_of_each_is_found_where_it_belongs(tree: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "tests.additions.try_them"],
        cwd=tree,
        env=environment(PYTHONPATH=str(tree)),  # without coverage: it would count the copy as more code
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert (done.returncode, done.stderr) == (0, "")
    found = json.loads(done.stdout)
    assert found.keys() == {name.partition(" ")[0] for name in ADDITIONS}
    assert {name: seen for name, seen in found.items() if not all(seen)} == {}


_COUNTED_ELSEWHERE = {
    "board": (1, 0, 0),  # tests/target/test_boards.py builds one that is a single file
    "field of the protocol": (0, 1, 0),  # tests/tools/test_protocol_code.py adds one to the DBC alone
}


def test_the_page_says_how_many_places_are_edited_by_hand() -> None:
    page = (_ROOT / "CONTRIBUTING.md").read_text("utf-8")
    rows = re.findall(r"^\| ([a-z ]+) \| (\d+) \| (\d+) \| (\d+) \|$", page, re.MULTILINE)
    said = {name: tuple(map(int, numbers)) for name, *numbers in rows}
    counted = {
        name: (len(addition.files), len(addition.places), len(addition.tests))
        for name, addition in ADDITIONS.items()
    }
    assert said == counted | _COUNTED_ELSEWHERE
