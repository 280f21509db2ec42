"""A short slice of tests/trust/fuzz.py: whatever is read may be damaged, and is then refused in one line that names the file."""

from __future__ import annotations

import importlib.util
import os
import random
import signal
import zlib
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "trust" / "fuzz.py"
INPUTS = 150
SPECIFICATION = importlib.util.spec_from_file_location("fuzz", SCRIPT)
assert SPECIFICATION is not None
assert SPECIFICATION.loader is not None
fuzz = importlib.util.module_from_spec(SPECIFICATION)
SPECIFICATION.loader.exec_module(fuzz)
NAMES = [
    *(f"recipe-{kind}" for kind in fuzz.KINDS),
    *("set", "material", "csv", "measurement", "export", "load-table", "folder-summary", "folder-mastercurve"),
]


@pytest.fixture(scope="module")
def targets(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    return fuzz.targets(tmp_path_factory.mktemp("fuzz"))


def test_no_target_is_left_out(targets: dict[str, object]) -> None:
    assert sorted(targets) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_damaged_input_is_refused_in_a_line(name: str, targets: dict[str, fuzz.Target]) -> None:
    previous = signal.signal(signal.SIGALRM, fuzz._alarm)
    # the same inputs in continuous integration, others everywhere else
    rng = random.Random(zlib.crc32(name.encode()) if os.environ.get("CI") else None)
    try:
        for _ in range(INPUTS):
            data = fuzz.damage(targets[name].seeds, rng)
            wrong = targets[name].wrong(data)
            assert wrong is None, (wrong, data)
    finally:
        signal.signal(signal.SIGALRM, previous)
