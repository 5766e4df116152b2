"""The shape of the packages: short modules, no circle of imports, no heavy library behind the loop."""

from __future__ import annotations

import ast
import statistics
import subprocess
import sys
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

_ROOT = Path(__file__).parents[1]
_RUN = {"__init__", "__main__", "api", "assembly", "fault_hooks", "loop", "result", "run_engine", "session"}
_SHARED_WORDS = {"backend", "errors", "trip_request", "values"}
_MODULE_LINES_MAX, _MODULE_LINES_MEDIAN, _FUNCTION_LINES_P95 = 300, 110, 25
_TOP_LEVEL = {
    *("dcmp_hil", "docs", "examples", "firmware", "sim_backend", "tests", "tools", "Makefile"),
    *("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "README.md", "SECURITY.md"),
    *("pyproject.toml", "requirements.txt", "requirements-dev.txt"),
}
_HEAVY = {"can", "numpy", "pydantic", "rerun", "serial"}


@cache
def _modules() -> dict[str, ast.Module]:
    """Return every module of the two packages, parsed, by its dotted name."""
    files = [file for package in ("dcmp_hil", "sim_backend") for file in (_ROOT / package).rglob("*.py")]
    return {_name_of(file): ast.parse(file.read_text("utf-8")) for file in files}


def _name_of(file: Path) -> str:
    return ".".join(file.relative_to(_ROOT).with_suffix("").parts).removesuffix(".__init__")


def _nodes(node: ast.AST, *, types: bool) -> Iterator[ast.AST]:
    """Yield all nodes, also in functions; without `types` none that only the type checker reads."""
    for child in ast.iter_child_nodes(node):
        if types or not (isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"):
            yield child
            yield from _nodes(child, types=types)


def _imports_of(tree: ast.Module, *, types: bool = True) -> set[str]:
    """Return what a module imports: modules of the packages in full, others by their first name."""
    found: set[str] = set()
    for node in _nodes(tree, types=types):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = {f"{node.module}.{alias.name}" for alias in node.names} & _modules().keys()
            found |= inner or {node.module}
    return {name if name in _modules() else name.partition(".")[0] for name in found}


def _lines_of(folders: tuple[str, ...]) -> dict[str, int]:
    files = [file for folder in folders for file in (_ROOT / folder).rglob("*.py")]
    return {str(file.relative_to(_ROOT)): len(file.read_text("utf-8").splitlines()) for file in files}


def test_modules_and_functions_are_short() -> None:
    everything = _lines_of(("dcmp_hil", "sim_backend", "tools", "tests"))
    assert {name: lines for name, lines in everything.items() if lines > _MODULE_LINES_MAX} == {}
    assert statistics.median(_lines_of(("dcmp_hil", "sim_backend")).values()) <= _MODULE_LINES_MEDIAN
    functions = [
        (node.end_lineno or 0) - node.lineno + 1 - _docstring_lines(node)
        for tree in _modules().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    assert statistics.quantiles(functions, n=20)[-1] <= _FUNCTION_LINES_P95


def _docstring_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    first = node.body[0]
    is_text = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return (first.end_lineno or 0) - first.lineno + 1 if is_text else 0


def test_no_module_imports_itself_by_a_detour() -> None:
    graph = {name: _imports_of(tree) & _modules().keys() for name, tree in _modules().items()}
    assert sum(map(len, graph.values())) > 1000
    TopologicalSorter(graph).prepare()  # raises CycleError, with the circle


def test_beside_the_rooms_are_one_run_and_the_words_that_all_share() -> None:
    assert {file.stem for file in (_ROOT / "dcmp_hil").glob("*.py")} == _RUN | _SHARED_WORDS


def test_a_class_has_a_name_of_its_own() -> None:
    classes = [
        node.name for tree in _modules().values() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)
    ]
    assert {name for name, count in Counter(classes).items() if count > 1} == set()


def test_one_module_looks_for_similar_names() -> None:
    users = {name for name, tree in _modules().items() if "difflib" in _imports_of(tree)}
    assert users - {"dcmp_hil.config.edited_file"} == {
        "dcmp_hil.common.similar_names"
    }  # the other shows a diff


def test_processes_of_our_own_are_started_in_one_place() -> None:
    assert _users("'-c'") == {"dcmp_hil.platform.python_command"}
    of_ten_lines = {
        "dcmp_hil.platform.display",
        "dcmp_hil.platform.parent_death",
    }  # that import nothing of ours
    assert _users("python_command(") == {"dcmp_hil.ipc.child_process"} | of_ten_lines
    assert _users("os.getppid()") == {"dcmp_hil.ipc.child_process"}


def _users(code: str) -> set[str]:
    """Return the modules in which a call or a list contains a piece of code."""
    return {
        name
        for name, tree in _modules().items()
        if any(code in ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Call | ast.List))
    }


def test_no_heavy_library_stands_behind_the_loop_not_even_in_a_function() -> None:
    reached, ahead = set[str](), {"dcmp_hil.loop"}
    while ahead:
        name = ahead.pop()
        reached.add(name)
        if name in _modules():
            packages = {name.rsplit(".", depth)[0] for depth in range(1, name.count(".") + 1)}
            ahead |= (_imports_of(_modules()[name], types=False) | packages) - reached
    assert {"dcmp_hil.safety.supervisor", "dcmp_hil.values"} <= reached
    assert reached & _HEAVY == set()


def test_loop_is_imported_without_a_heavy_library() -> None:
    code = "import sys, dcmp_hil.loop; print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    loaded = set(done.stdout.split())
    assert "dcmp_hil.loop" in loaded
    assert loaded & _HEAVY == set()


def test_the_top_level_holds_nothing_by_accident() -> None:
    told = subprocess.run(["git", "ls-files"], cwd=_ROOT, capture_output=True, text=True, check=False)
    if told.returncode:
        pytest.skip("this copy of the project is no clone: nothing tells what belongs to it")
    top = {name.partition("/")[0] for name in told.stdout.splitlines()}
    assert {name for name in top if not name.startswith(".")} <= _TOP_LEVEL
