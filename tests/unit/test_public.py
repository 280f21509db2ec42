from __future__ import annotations

import pickle
import subprocess
import sys
from inspect import signature
from types import FunctionType

import pytest

import dielast


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
    elsewhere = "import pickle, sys; print(*(function.__name__ for function in pickle.load(sys.stdin.buffer)))"
    stored = pickle.dumps([*functions.values()])
    done = subprocess.run([sys.executable, "-c", elsewhere], input=stored, capture_output=True, check=True)
    assert done.stdout.decode().split() == [*functions]
    assert [*signature(dielast.relax).parameters][:2] == ["material", "steps"]


def test_importing_the_package_loads_nothing_heavy_and_simulating_numpy_alone() -> None:
    code = (
        "import sys, dielast\nheavy = {'numpy', 'scipy', 'pandas', 'matplotlib', 'pydantic'}\n"
        "print(sorted(heavy & sys.modules.keys()))\ndielast.creep, dielast.relax, dielast.actuate, dielast.failure_map\n"
        "print(sorted(heavy & sys.modules.keys()))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n['numpy']\n"
