"""Change the source in one place and see whether the tests notice: `python tests/trust/mutate.py --sample 400` (`--help` for more).

The places are drawn by chance from the numerical core, or from what is named: modules, or `fitting` for those that make master
curves and spectra. First all tests run once, to learn which of them reach which line and how long they take. Then, for each change,
a forked process that has numpy and its like imported already runs the tests that reach the line, the short ones and those that
noticed most so far first, until one fails. Shown are the score of each module and the changes that no test noticed; `--numbers`
tries some of them again, such as after a test was added.

A change that cannot be noticed is none of the tests' business: numbers that only tell an iteration when to stop or a step how long
to be (`TUNING` in changes.py), and what `equivalent.txt` lists with a reason, by hand. These are drawn as well, but not tried, and
the scores are stated with and without them.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import random
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
from itertools import chain
from pathlib import Path
from types import CodeType, ModuleType

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import coverage
import hypothesis
import matplotlib
import numpy
import pandas
import pint
import pydantic
import pytest
import rich.progress
import scipy.optimize
import scipy.signal
import scipy.stats
import typer
from changes import GROUPS, PACKAGE, STATED, Mutant, mutants

PRELOADED = (coverage, hypothesis, matplotlib, numpy, pandas, pint, pydantic, rich, scipy, typer)  # for every forked process
TOP = PACKAGE.parent
EQUIVALENT = Path(__file__).with_name("equivalent.txt")
TESTS = ("tests/unit", "tests/golden/test_golden.py", "tests/physics", "tests/property")


class Changed(SourceFileLoader):
    """Imports one module from a changed tree."""

    def __init__(self, mutant: Mutant) -> None:
        self.mutant = mutant
        super().__init__("dielast." + mutant.module.replace("/", "."), str(PACKAGE / f"{mutant.module}.py"))

    def find_spec(self, fullname: str, path: object = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Only of the changed module."""
        return spec_from_file_location(fullname, self.path, loader=self) if fullname == self.name else None

    def get_code(self, fullname: str) -> CodeType:
        """The changed code."""
        return self.mutant.code()


class Durations:
    """What each test took, in s, and which failed."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self.failed: set[str] = set()

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add up set-up, call and tear-down."""
        self.seconds[report.nodeid] += report.duration
        if not report.passed:
            self.failed.add(report.nodeid)


def forked(action: Callable[[], int], timeout: float, silent: bool = True) -> int | None:
    """The exit code of an action in a process of its own; None where it took too long."""
    child = os.fork()
    if child == 0:
        code = 70
        try:
            null = os.open(os.devnull, os.O_WRONLY)
            for stream in (1, 2) if silent else ():
                os.dup2(null, stream)
            os.setsid()
            code = action()
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    end, pause = time.monotonic() + timeout, 0.01
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(pause)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


def run_tests(tests: Sequence[str], *plugins: object) -> int:
    """Run tests, the same examples every time; needs a process of its own."""
    sys.path.insert(0, str(TOP))
    os.chdir(TOP)
    hypothesis.settings.register_profile(
        "mutants", derandomize=True, deadline=None, database=None, phases=[hypothesis.Phase.explicit, hypothesis.Phase.generate]
    )
    hypothesis.settings.load_profile("mutants")
    return int(pytest.main(["-q", "-p", "no:cacheprovider", "--assert=plain", *tests], plugins=list(plugins)))


def reached(store: Path) -> tuple[dict[str, dict[str, list[str]]], dict[str, float]]:
    """Tests that reach each line, {module: {line: [test]}}, and how long each takes; kept in `store` for the next time. Tests that
    are skipped or fail as it is are left out.
    """
    if not store.exists():

        def learn() -> int:
            cover = coverage.Coverage(data_file=None, source=[str(PACKAGE)], config_file=False)
            durations = Durations()

            class Contexts:
                def pytest_runtest_setup(self, item: pytest.Item) -> None:
                    cover.switch_context(item.nodeid)

            cover.start()
            sys.path.insert(0, str(TOP))
            for module in chain(*GROUPS.values()):  # what runs at import is no one test's
                importlib.import_module("dielast." + module.replace("/", "."))
            code = run_tests(TESTS, durations, Contexts())
            cover.stop()
            data, lines = cover.get_data(), {}
            for name in data.measured_files():
                by_line = data.contexts_by_lineno(name)
                module = Path(name).relative_to(PACKAGE).with_suffix("").as_posix()
                lines[module] = {str(line): sorted(set(tests) - durations.failed - {""}) for line, tests in by_line.items()}
            store.write_text(json.dumps({"lines": lines, "seconds": durations.seconds}), "utf-8")
            return code

        print("running all tests once", flush=True)
        code = forked(learn, 3600, silent=False)
        if code not in (0, 1) or not store.exists():
            raise SystemExit(f"the tests must run before anything is changed (pytest ended with {code})")
    known = json.loads(store.read_text("utf-8"))
    return known["lines"], known["seconds"]


def tests_of(
    mutant: Mutant, lines: dict[str, dict[str, list[str]]], seconds: dict[str, float], successes: Counter[str], budget: float
) -> list[str]:
    """Tests that reach the change, or the module if it is made at import: those with most successes for their time first, and as
    many as the `budget` (s) allows.
    """
    own = lines.get(mutant.module, {})
    reaching = [] if mutant.at_import else own.get(str(mutant.line), [])
    tests = reaching or sorted({test for line in own.values() for test in line})
    chosen: list[str] = []
    spent = 0.0
    for test in sorted(tests, key=lambda test: (seconds[test] + 0.01) / (successes[test] + 0.1)):
        spent += seconds[test]
        if spent > budget and chosen:
            break
        chosen.append(test)
    return chosen


def noticed(mutant: Mutant, tests: Sequence[str], timeout: float, note: Path) -> bool | None:
    """Whether a test fails under the change, named in the file `note`; None if it never came to an end, which is noticed too."""

    class Note:
        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            if report.failed:
                note.write_text(report.nodeid, "utf-8")

    def action() -> int:
        sys.meta_path.insert(0, Changed(mutant))
        return run_tests(["-x", *tests], Note())

    note.write_text("", "utf-8")
    code = forked(action, timeout)
    return None if code is None else code != 0


def listed() -> dict[str, str]:
    """Changes that cannot be noticed, and why."""
    lines = EQUIVALENT.read_text("utf-8").splitlines() if EQUIVALENT.exists() else []
    entries = (line.split("  # ", 1) for line in lines if line.strip() and not line.startswith("#"))
    return {change.strip(): reason.strip() for change, reason in entries}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", default=["core"], help="core (by default) or fitting, or such as simulate/film")
    parser.add_argument("--sample", type=int, default=400, help="number of changes; 0 for all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--budget", type=float, default=30.0, help="s of tests for each change")
    parser.add_argument("--stated", action="store_true", help="instead, what the golden files alone must notice")
    parser.add_argument("--numbers", help="of the sample, only these, such as 7,9,14")
    parser.add_argument("--among", default="", help="only tests below this folder or of this file, such as tests/golden")
    parser.add_argument("--kind", help="only changes of this kind, such as constant, sign, operator, swap")
    parser.add_argument("--only", help="only changes whose line reads like this, such as 'GAS_CONSTANT ='")
    parser.add_argument("--learnt", type=Path, help="file that keeps which tests reach which line from one run to the next")
    arguments = parser.parse_args()

    if arguments.stated:
        arguments.among, arguments.sample = "tests/golden", 0
        every = [Mutant.stated(*each) for each in STATED]
    else:
        modules = [module for name in arguments.modules for module in GROUPS.get(name, (name,))]
        every = [mutant for module in modules for mutant in mutants(module)]
    if arguments.kind:
        every = [mutant for mutant in every if mutant.kind == arguments.kind]
    if arguments.only:
        every = [mutant for mutant in every if arguments.only in mutant.change]
    chosen = random.Random(arguments.seed).sample(every, min(arguments.sample or len(every), len(every)))
    numbers = [int(number) for number in (arguments.numbers or "").split(",") if number]
    known, successes = listed(), Counter[str]()
    scores: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    with tempfile.TemporaryDirectory() as scratch:
        lines, seconds = reached(arguments.learnt or Path(scratch) / "learnt.json")
        for own in lines.values():
            own.update({line: [test for test in tests if test.startswith(arguments.among)] for line, tests in own.items()})
        print(f"{len(chosen)} of {len(every)} changes", flush=True)
        for number, mutant in enumerate(chosen, start=1):
            if numbers and number not in numbers:
                continue
            reason, note = "by rule" if mutant.tuning else known.get(mutant.change, ""), Path(scratch) / "note"
            tests = tests_of(mutant, lines, seconds, successes, arguments.budget)
            result = noticed(mutant, tests, 30 + 4 * arguments.budget, note) if tests and not reason else False
            successes[note.read_text("utf-8") if result else ""] += 1
            for score in (scores[mutant.module], scores["all"]):
                score[0] += 1
                score[1] += result is not False
                score[2] += bool(reason)
            if result is False:
                print(
                    f"{number:4} {mutant.module}:{mutant.line}: [{mutant.kind}] {mutant.change}  # {reason or 'UNNOTICED'}",
                    flush=True,
                )
    print(f"\n{'module':34}{'changes':>8}{'noticed':>8}{'equiv.':>8}{'score':>8}{'of all':>8}")
    for module, (total, found, equal) in sorted(scores.items(), key=lambda item: item[0] == "all"):
        print(f"{module:34}{total:8}{found:8}{equal:8}{found / max(1, total - equal):8.1%}{found / total:8.1%}")
    total, found, equal = scores["all"]
    rate = found / max(1, total - equal)
    print(f"sampling: +-{1.96 * (rate * (1 - rate) / max(1, total - equal)) ** 0.5:.1%} (95 %)")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
