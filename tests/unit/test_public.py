from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import dielast


def test_every_public_name_is_there_and_documented() -> None:
    for name in dielast.__all__:
        thing = getattr(dielast, name)
        assert name == "__version__" or thing.__doc__, name
    assert len(dielast.__all__) == Path(dielast.__file__).with_suffix(".pyi").read_text().count(" as ") >= 53
    assert set(dir(dielast)) >= set(dielast.__all__)
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
