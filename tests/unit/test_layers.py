"""The package: imports go only downwards, public names, random numbers each of a stream of its own."""

from __future__ import annotations

import ast
import pickle
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from inspect import signature
from itertools import combinations
from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

import dielast
from dielast.numerics.random_streams import stream

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


def test_every_public_name_is_there_and_documented() -> None:
    for name in dielast.__all__:
        thing = getattr(dielast, name)
        assert name == "__version__" or thing.__doc__, name
    star: dict[str, object] = {}
    exec("from dielast import *", star)
    assert star.keys() - {"__builtins__"} == set(dielast.__all__) == set(dir(dielast))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = dielast.nothing


def test_public_functions_can_be_pickled_and_keep_their_signatures() -> None:
    functions = {name: thing for name in dielast.__all__ if isinstance(thing := getattr(dielast, name), FunctionType)}
    assert all(getattr(dielast, name) is function is pickle.loads(pickle.dumps(function)) for name, function in functions.items())
    assert [*signature(dielast.relax).parameters][:2] == ["material", "steps"]


def test_importing_the_package_loads_nothing_heavy_and_simulating_numpy_alone() -> None:
    code = (
        "import sys, dielast\nheavy = {'numpy', 'scipy', 'pandas', 'matplotlib', 'pydantic'}\n"
        "print(sorted(heavy & sys.modules.keys()))\ndielast.creep, dielast.relax, dielast.actuate, dielast.failure_map\n"
        "print(sorted(heavy & sys.modules.keys()))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n['numpy']\n"


NAMES = (
    "noise",
    "measurements",
    "model error",
    "material",
    "edge",
    "equilibrium modulus",
    "levels",
    "failures",
    "law",
    "laws",
    "beyond the curve",
    "spectra beyond the curve",
    "thickness",
    "posterior",
    "sensitivity",
)


def test_no_two_streams_coincide() -> None:
    keys = [(seed, name, *more) for seed in (0, 1, 3) for name in NAMES for more in ((), (0,), (1,), (3,), (0, 0), (3, 1))]
    first = {key: tuple(stream(key[0], key[1], *key[2:]).random(4)) for key in keys}
    assert len(set(first.values())) == len(keys)
    drawn = np.array([stream(1, name, *more).standard_normal(20_000) for name in NAMES for more in ((), (0,), (3,))])
    # independent of each other: correlations of 20,000 numbers within 5 of their standard errors
    assert max(abs(float(a @ b)) / a.size for a, b in combinations(drawn, 2)) < 5 / np.sqrt(20_000)


def test_a_stream_is_its_seed_its_name_and_its_indices() -> None:
    np.testing.assert_array_equal(stream(7, "noise", 2).random(5), stream(7, "noise", 2).random(5))


def test_every_random_number_comes_from_a_stream_of_its_own_name() -> None:
    used: list[str] = []
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_text()
        if path.name != "random_streams.py":
            assert "default_rng" not in text, path
            assert "np.random." not in text.replace("np.random.Generator", ""), path
            used += re.findall(r"(?<!\w)stream\([^\"()]*, \"([^\"]+)\"", text)
    assert sorted(used) == sorted(NAMES)
