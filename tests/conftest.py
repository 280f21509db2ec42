"""Fixtures that every test may use."""

from __future__ import annotations

import gc
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from processes import PYTHON

# no example fails because the machine is busy; the same ones every time where a result must not be a matter of luck
settings.register_profile("any machine", deadline=None, max_examples=30, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("ci", settings.get_profile("any machine"), derandomize=True)
settings.load_profile("ci" if os.environ.get("CI") else "any machine")

# what a script starts in the background ignores Ctrl-C, and so would every program that the tests start
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# as the command line does before numpy is loaded: two processes of tests with two threads each would wait for each other
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

# one cache of fonts for all that is drawn, apart from the user's own
USER = getattr(os, "getuid", str)()  # which not every system has
os.environ.setdefault("MPLCONFIGDIR", str(Path(tempfile.gettempdir()) / f"dielast-tests-matplotlib-{USER}"))

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


@pytest.fixture(scope="session")
def server() -> Iterator[str]:
    """The address of server.py: a short one, since a socket's has at most some hundred characters."""
    with tempfile.TemporaryDirectory(prefix="dielast") as folder, socket.socket(socket.AF_UNIX) as listener:
        address = f"{folder}/server"
        listener.bind(address)
        listener.listen()
        program = [*PYTHON, str(Path(__file__).with_name("server.py")), str(listener.fileno())]
        with subprocess.Popen(program, stdin=subprocess.PIPE, pass_fds=[listener.fileno()]) as process:
            yield address
            assert process.stdin is not None
            process.stdin.close()


SLOW = Path(__file__).with_name("slow.txt")
LONG_RUNS = ("tests/physics/", "tests/recipes/", "tests/cli/test_cluster.py", "tests/cli/test_readme.py")
TAKEN: dict[str, float] = defaultdict(float)  # s, by test without its parameters, the longest of them


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="refresh the golden files under tests/golden")
    parser.addoption("--quick", action="store_true", help="leave out long runs, and the tests that slow.txt lists")
    parser.addoption("--update-slow", type=float, metavar="SECONDS", help="write to slow.txt which tests took longer than that")


def function_of(test: str) -> str:
    """A test without its parameters."""
    return test.partition("[")[0]


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """What is not for this run is not even imported: the files of tests/trust, and in a quick run those of long runs."""
    names = (LONG_RUNS if config.getoption("--quick") else ()) + (
        ("tests/trust/",) if "not trust" in config.option.markexpr else ()
    )
    left_out = tuple(f"{SLOW.parents[1].as_posix()}/{name}" for name in names)
    return True if f"{collection_path.as_posix()}/".startswith(left_out) else None


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--update-golden"):
        os.environ["DIELAST_PEERS"] = "keep"  # peers/kept.py


def pytest_collection_finish() -> None:
    """What has been collected stays: it need not be looked through for rubbish again and again, which took a tenth of the time."""
    gc.freeze()
    gc.set_threshold(20_000)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--quick"):
        slow = set(SLOW.read_text().split())
        left_out = {item for item in items if function_of(item.nodeid) in slow}
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    if report.when in ("setup", "call"):
        TAKEN[function_of(report.nodeid)] = max(TAKEN[function_of(report.nodeid)], report.duration)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Tests that did not run stay in the list as they were; only the process that gathers all reports writes it."""
    if session.config.getoption("--update-golden") and "peers.kept" in sys.modules:
        sys.modules["peers.kept"].keep()
    longest = session.config.getoption("--update-slow")
    if longest is not None and not hasattr(session.config, "workerinput"):
        kept = {test for test in SLOW.read_text().split() if test not in TAKEN}
        slow = kept | {test for test, seconds in TAKEN.items() if seconds > longest and not test.startswith(LONG_RUNS)}
        SLOW.write_text("".join(f"{test}\n" for test in sorted(slow)))
