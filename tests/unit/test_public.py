from __future__ import annotations

import subprocess
import sys

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


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, dielast; print(sorted({'numpy', 'scipy', 'pandas', 'matplotlib', 'pydantic'} & sys.modules.keys()))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_simulating_loads_numpy_alone() -> None:
    code = (
        "import sys, dielast; dielast.creep, dielast.relax, dielast.actuate, dielast.failure_map\n"
        "print(sorted({'scipy', 'pandas', 'matplotlib', 'pydantic'} & sys.modules.keys()))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
