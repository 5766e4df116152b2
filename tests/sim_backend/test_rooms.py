"""The rooms of the simulator stand in one order: no module reaches itself through what it imports."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import sim_backend

ROOT = Path(sim_backend.__file__).parent


def imported_by(file: Path) -> set[str]:
    """Return the modules that a file names in imports, those for the type checker alone among them."""
    tree = ast.parse(file.read_text())
    found = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    return {
        name
        for node in found
        for name in (f"{node.module}", *(f"{node.module}.{alias.name}" for alias in node.names))
        if name.startswith("sim_backend.")
    }


def test_no_module_imports_itself_through_others_not_even_for_types() -> None:
    files = {
        ".".join(("sim_backend", *file.relative_to(ROOT).with_suffix("").parts)): file
        for file in ROOT.rglob("*.py")
        if file.name != "__init__.py"
    }
    graph = {name: imported_by(file) & files.keys() for name, file in files.items()}
    order = list(TopologicalSorter(graph).static_order())  # CycleError names the modules of a circle
    assert set(order) == set(graph)
    assert sum(map(len, graph.values())) > len(graph)  # the graph is not an empty one


def test_the_board_knows_nothing_of_faults() -> None:
    for file in (*ROOT.glob("*.py"), *(ROOT / "board").glob("*.py")):
        assert not any(name.startswith("sim_backend.faults") for name in imported_by(file)), file
