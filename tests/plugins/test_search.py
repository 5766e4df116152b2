"""Classes that a rig names: found, made, looked at without running, and every word about what is wrong."""

from __future__ import annotations

import itertools
import sys
from typing import TYPE_CHECKING

import pytest

from dcmp_hil import load_rig
from dcmp_hil.assembly import make_observer
from dcmp_hil.control.references.periodic import Sine
from dcmp_hil.control.trajectory import Trajectory
from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins import find_named, make_named
from dcmp_hil.plugins.roles import BACKEND, CONTROLLER, OBSERVER, Role
from dcmp_hil.plugins.source import look_at
from dcmp_hil.values import Sample

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_numbers = itertools.count()

OBSERVER_TEXT = """
from dcmp_hil import Estimate

class Obs:
    def __init__(self, context, gain=1.0):
        self.gain = gain

    def update(self, sample):
        return Estimate(sample.position, 0.0, 0.0)
"""


@pytest.fixture
def module() -> Iterator[str]:
    """Give a name for a module that no other test has, forgotten at the end."""
    name = f"plug_in_{next(_numbers)}"
    yield name
    for known in [known for known in sys.modules if known.partition(".")[0] == name]:
        del sys.modules[known]


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
    observer = make_observer(rig, Trajectory(Sine(), 2.0))
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


# ---------------------------------------------------------------- what is wrong in it

BROKEN: dict[str, tuple[str | bytes, str]] = {
    "syntax": ("\nclass Obs(:\n", "line 2: invalid syntax"),
    "indent": ("class Obs:\npass\n", "line 2: expected an indented block"),
    "tabs": ("class Obs:\n    a = 1\n\tb = 2\n", "line 3"),
    "return": ("class Obs: pass\nreturn 1\n", "line 2: 'return' outside function"),
    "latin": (b"a = '\xe9'\nclass Obs: pass\n", "utf-8"),
    "missing": ("import not_installed_anywhere\nclass Obs: pass\n", "not_installed_anywhere"),
    "division": ("a = 1\n1 / 0\n", "ZeroDivisionError: division by zero (FILE, line 2)"),
    "exit": ("import sys\nsys.exit(3)\n", "SystemExit: 3 (FILE, line 2)"),
    "deep": ("def f():\n    raise ValueError('a\\nb')\nf()\n", "ValueError: a b (FILE, line 2)"),
    "lines": ("raise ValueError('x' * 10_000)\n", "xxx ... (FILE, line 1)"),
    "no class": ("class Ob: pass\n", "has no class Obs. Did you mean Ob?"),
    "number": ("Obs = 7\n", "has no class Obs"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_wrong_in_a_module_is_one_line_with_its_place(tmp_path: Path, module: str, name: str) -> None:
    text, says = BROKEN[name]
    file = tmp_path / f"{module}.py"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ConfigError, match=rf'^observer\.kind: got "{module}:Obs", but ') as caught:
        find_named(f"{module}:Obs", "observer.kind", folders=[tmp_path])
    (line,) = caught.value.faults
    assert says.replace("FILE", str(file)) in line
    assert "\n" not in line
    assert len(line) < 700
    assert module in line
    assert module not in sys.modules or name in {"no class", "number"}


WRONG: dict[str, tuple[Role, str, dict[str, float], str]] = {
    "no context": (
        OBSERVER,
        "class Obs:\n  def __init__(self): ...\n  def update(self, s): ...",
        {},
        "Class(",
    ),
    "unknown option": (
        OBSERVER,
        "class Obs:\n  def __init__(self, c, gain=1): ...\n  def update(self, s): ...",
        {"gian": 1.0},
        "gian",
    ),
    "option not given": (
        OBSERVER,
        "class Obs:\n  def __init__(self, c, *, gain): ...\n  def update(self, s): ...",
        {},
        "gain",
    ),
    "no update": (OBSERVER, "class Obs:\n  def __init__(self, c): ...", {}, "has no method update"),
    "no read": (BACKEND, "class Obs:\n  def __init__(self, r, c): ...", {}, "has no method __enter__"),
}
RUN_ONLY: dict[str, tuple[Role, str, dict[str, float], str]] = {
    "raises": (OBSERVER, "class Obs:\n  def __init__(self, c):\n    1 / 0", {}, "by zero (FILE, line 3)"),
    "exits": (
        OBSERVER,
        "class Obs:\n  def __init__(self, c):\n    exit(1)",
        {},
        "SystemExit: 1 (FILE, line 3)",
    ),
    "update without a sample": (
        OBSERVER,
        "class Obs:\n  def __init__(self, c): ...\n  def update(self): ...",
        {},
        "does not take 1 argument.",
    ),
    "update of one": (
        CONTROLLER,
        "class Obs:\n  def __init__(self, c): ...\n  def update(self, s): ...",
        {},
        "does not take 2 arguments.",
    ),
    "async": (
        OBSERVER,
        "class Obs:\n  def __init__(self, c): ...\n  async def update(self, s): ...",
        {},
        "async",
    ),
    "abstract": (
        OBSERVER,
        "import abc\nclass Obs(abc.ABC):\n  __init__ = print\n  @abc.abstractmethod\n  def update(self): ...",
        {},
        "abstract",
    ),
}


@pytest.mark.parametrize("name", WRONG | RUN_ONLY)
def test_class_that_cannot_be_made_is_named_with_its_place(tmp_path: Path, module: str, name: str) -> None:
    role, text, options, says = (WRONG | RUN_ONLY)[name]
    file = tmp_path / f"{module}.py"
    file.write_text(text)
    with pytest.raises(ConfigError, match=rf"^{role.key}: {module}:Obs ") as caught:
        make_named(f"{module}:Obs", role, [tmp_path], [None] * role.arguments, options)
    (line,) = caught.value.faults
    assert says.replace("FILE", str(file)) in line
    assert f"{file}, line " in line


# ---------------------------------------------------------------- looked at without running it


@pytest.mark.parametrize(
    "name",
    [name for name in BROKEN if name not in {"missing", "division", "exit", "deep", "lines", "number"}],
)
def test_look_finds_what_is_wrong_without_running_it(tmp_path: Path, module: str, name: str) -> None:
    text, says = BROKEN[name]
    (tmp_path / f"{module}.py").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ConfigError, match=rf"^observer\.kind: .*{module}") as caught:
        look_at(f"{module}:Obs", OBSERVER, [tmp_path])
    assert says in str(caught.value)
    assert module not in sys.modules


@pytest.mark.parametrize("name", WRONG)
def test_look_finds_a_class_that_could_not_be_made(tmp_path: Path, module: str, name: str) -> None:
    role, text, options, says = WRONG[name]
    (tmp_path / f"{module}.py").write_text(f"raise SystemExit\n{text}")
    with pytest.raises(ConfigError, match=rf"{module}\.py, line 2") as caught:
        look_at(f"{module}:Obs", role, [tmp_path], options)
    assert says in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        OBSERVER_TEXT,
        "from dcmp_hil.control.observers.super_twisting import SuperTwisting\nclass Obs(SuperTwisting): pass",
        "from dcmp_hil.control.observers.super_twisting import SuperTwisting as Obs",
        "from dcmp_hil.control.observers.super_twisting import *",
        "if 1:\n  class Obs:\n    def update(self, s): ...",
        "try:\n  import x\nexcept ImportError:\n  class Obs:\n    def update(self, s): ...",
        "def Obs(context, **options): ...",
        "Obs = type('Obs', (), {})",
        "def __getattr__(name): ...",
        "import dataclasses\n@dataclasses.dataclass\nclass Obs:\n  context: object\n  update = print",
        "class Obs:\n  def __init__(self, *args): ...\n  update = print",
    ],
)
def test_look_accepts_what_may_be_right(tmp_path: Path, module: str, text: str) -> None:
    (tmp_path / f"{module}.py").write_text(f"{text}\n1 / 0\n")
    look_at(f"{module}:Obs", OBSERVER, [tmp_path])
    assert module not in sys.modules


def test_look_does_not_import_a_package_to_look_into_it(tmp_path: Path, module: str) -> None:
    (tmp_path / module).mkdir()
    (tmp_path / module / "__init__.py").write_text("1 / 0\n")
    (tmp_path / module / "mine.py").write_text(OBSERVER_TEXT)
    look_at(f"{module}.mine:Obs", OBSERVER, [tmp_path])
    with pytest.raises(ConfigError, match="No module named"):
        look_at(f"{module}.other:Obs", OBSERVER, [tmp_path])
    (tmp_path / module / "__init__.py").write_text("(\n")
    with pytest.raises(ConfigError, match=r"__init__\.py, line 1"):
        look_at(f"{module}.mine:Obs", OBSERVER, [tmp_path])
