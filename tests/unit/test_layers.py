"""Imports point only downwards: a module may import from the layers below its own, or from its own."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "dielast"
# from the ground up; a name stands for a module or a whole folder
LAYERS = [
    {"_version", "errors"},
    {"units", "streams", "table"},
    {"result"},
    {"gent", "shift", "prony", "rosenbrock", "span"},
    {"kinematics", "material", "course", "roots"},
    {"load"},
    {"point", "ensemble", "plausible"},
    {"symmetric", "jump", "stability"},
    {"integrate"},
    {"events"},
    {"characterise", "simulate", "export"},
    {"files", "header", "workbook"},
    {"measured", "sharing"},
    {"instruments"},
    {"recipe", "plots"},
    {"workflow"},
    {"cli"},
]
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}


def imported(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("dielast."):
            names.add(node.module.split(".")[1])
        elif isinstance(node, ast.Import):
            names.update(alias.name.split(".")[1] for alias in node.names if alias.name.startswith("dielast."))
    return names


def test_imports_point_downwards() -> None:
    for path in sorted(PACKAGE.rglob("*.py")):
        part = path.relative_to(PACKAGE).with_suffix("").parts[0]
        if part == "__init__":
            continue
        for name in imported(path):
            assert LEVEL[name] < LEVEL[part] or name == part, f"{path.relative_to(PACKAGE)} imports {name}"


def test_every_module_has_a_layer() -> None:
    parts = {path.relative_to(PACKAGE).with_suffix("").parts[0] for path in PACKAGE.rglob("*.py")} - {"__init__"}
    assert parts <= LEVEL.keys()


def test_the_library_knows_no_files_and_no_text() -> None:
    for name in ("characterise", "simulate", "export"):
        for path in (PACKAGE / name).rglob("*.py"):
            text = path.read_text()
            assert not any(word in text for word in ("tomllib", "open(", "print(", "pandas", "matplotlib")), path


def test_solvers_do_not_warn() -> None:
    """They may run in another process or on another machine, where nobody would hear it."""
    solvers = ["integrate", "events", "jump", "stability", "symmetric", "point", "rosenbrock", "roots"]
    paths = [PACKAGE / f"{name}.py" for name in solvers] + sorted((PACKAGE / "simulate").rglob("*.py"))
    assert not [path for path in paths if "warn(" in path.read_text()]
