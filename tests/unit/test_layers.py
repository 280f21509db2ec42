"""The architecture: packages import only downwards, so that no circle runs through them, and solvers know no files and no text."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "dielast"
LOOSE = {"__init__", "__main__"}


def imported(path: Path) -> set[str]:
    """The packages of dielast that a module imports, wherever in it the import stands."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module == "dielast":
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("dielast."):
            names.add(node.module.split(".")[1])
        elif isinstance(node, ast.Import):
            names.update(alias.name.split(".")[1] for alias in node.names if alias.name.startswith("dielast."))
    return names


def test_no_circle_runs_through_the_packages() -> None:
    graph: dict[str, set[str]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        part = path.relative_to(PACKAGE).with_suffix("").parts[0]
        if part != "__init__":  # the package's face, which names what lies anywhere below it
            graph.setdefault(part, set()).update(imported(path) - {part})
    list(TopologicalSorter(graph).static_order())  # raises CycleError


def test_few_modules_lie_loose() -> None:
    assert {path.stem for path in PACKAGE.glob("*.py")} <= LOOSE


def test_the_library_knows_no_files_and_no_text() -> None:
    for name in ("material", "mechanics", "numerics", "relaxation", "simulate", "handover/export"):
        for path in (PACKAGE / name).rglob("*.py"):
            text = path.read_text()
            assert not any(word in text for word in ("tomllib", "open(", "print(", "pandas", "matplotlib")), path


def test_solvers_do_not_warn() -> None:
    """They may run in another process or on another machine, where nobody would hear it."""
    paths = [path for name in ("numerics", "mechanics", "simulate") for path in sorted((PACKAGE / name).rglob("*.py"))]
    assert not [path for path in paths if "warn(" in path.read_text()]
