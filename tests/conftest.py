"""Fixtures that every test may use."""

from __future__ import annotations

import os
import signal
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

# the same examples every time where a result must not be a matter of luck; new ones wherever else the tests run
settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")

# what a script starts in the background ignores Ctrl-C, and so would every program that the tests start
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# one cache of fonts for all that is drawn, apart from the user's own
os.environ.setdefault("MPLCONFIGDIR", str(Path(tempfile.gettempdir()) / f"dielast-tests-matplotlib-{os.getuid()}"))

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Callable[[str], Path]:
    """Path of a measured data file kept beside the checkout; absent data skips the test, except where CI promises it."""

    def find(name: str) -> Path:
        path = SHARED_DATA / name
        if not path.exists():
            if os.environ.get("CI"):
                pytest.fail(f"measured data {name} is missing, and CI must not skip it")
            pytest.skip(f"measured data {name} is not beside this checkout")
        return path

    return find


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="refresh the golden files under tests/golden")
