"""Classes that a rig names: what is wrong in them is told with its place, made or only read."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import pytest

from dcmp_hil.errors import ConfigError
from dcmp_hil.plugins.named_class import find_named, make_named
from dcmp_hil.plugins.roles import BACKEND, CONTROLLER, OBSERVER, Role
from dcmp_hil.plugins.static_check import look_at
from tests.plugins.observer_text import OBSERVER_TEXT

if TYPE_CHECKING:
    from pathlib import Path

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
