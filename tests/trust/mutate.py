"""Change the source in one place and see whether the tests notice: `python tests/trust/mutate.py --sample 400` (`--help` for more).

The places are drawn by chance from the numerical core, or from the modules that are named. First all tests run once, to learn which
of them reach which line and how long they take. Then, for each change, a forked process that has numpy and its like imported
already runs the tests that reach the line, the short ones and those that noticed most so far first, until one fails. Shown are the
score of each module and the changes that no test noticed; `--numbers` tries some of them again, such as after a test was added.

A change that cannot be noticed is none of the tests' business: numbers that only tell an iteration when to stop or a step how long
to be (by rule, below), and what `equivalent.txt` lists with a reason, by hand. These are drawn as well, but not tried, and the
scores are stated with and without them.
"""

from __future__ import annotations

import argparse
import ast
import copy
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
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import spec_from_file_location
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

PRELOADED = (coverage, hypothesis, matplotlib, numpy, pandas, pint, pydantic, rich, scipy, typer)  # for every forked process
TOP = Path(__file__).resolve().parents[2]
EQUIVALENT = Path(__file__).with_name("equivalent.txt")
TESTS = ("tests/unit", "tests/golden/test_golden.py", "tests/physics", "tests/property")
CORE = (
    *("gent", "kinematics", "point", "symmetric", "jump", "stability", "events", "integrate", "rosenbrock", "roots", "load"),
    *("shift", "prony", "material"),
    *(f"simulate/{name}" for name in ("actuate", "creep", "failure_map", "film", "history", "lifetime", "membrane", "output")),
    *(f"simulate/{name}" for name in ("relax", "setup", "trace", "voltage")),
    *(f"characterise/{name}" for name in ("schwarzl_staverman", "shiftfit", "curve")),
)
# constants that steer an iteration, a search or a step size: a slightly different one gives the same results within the tolerance
TUNING = {
    *("ITERATIONS", "SETTLED", "BALANCED", "POOL", "SAFETY", "SHRINK", "GROW", "FIRST_MOVE", "PROBED", "LEAST_STEP", "MOST_STEPS"),
    *("STALL_STEPS", "STALL_REACH", "CLOSE", "INSIDE", "DIP", "GOLDEN", "FALLS", "ROOT", "MOVE", "STRICT", "FOLD", "FOLD_STEPS"),
    *("FOLD_REACH", "HOLD", "HASTE", "SLOWEST_RATE", "FOLLOWER_WEIGHT"),
}
# what the golden files alone must notice: module, what stands there, what stands there instead
STATED = (
    ("shift", "GAS_CONSTANT = 8.314462618", "GAS_CONSTANT = 8.3145"),
    ("units", "ZERO_CELSIUS = 273.15", "ZERO_CELSIUS = 273.16"),
    ("material", "VACUUM_PERMITTIVITY = 8.8541878128e-12", "VACUUM_PERMITTIVITY = 8.855e-12"),
    ("point", "self.permittivity * field**2", "0.5 * self.permittivity * field**2"),
    ("symmetric", "points.permittivity * np.square(", "0.5 * points.permittivity * np.square("),
    ("stability", "maxwell = 2 * points", "maxwell = points"),
    ("shift", "-self.C1 * distance", "self.C1 * distance"),
    ("shift", "np.asarray(self.activation_energy", "np.asarray(-self.activation_energy"),
    ("shift", "self.log10_shift) - origin", "self.log10_shift) + origin"),
    ("shift", "/ np.log(10)", "/ np.log(10.001)"),
    ("material", "10 ** self.shift", "10 ** -self.shift"),
    ("simulate/membrane", "stretch_1=stretch[0]", "stretch_1=stretch[1]"),
    ("simulate/membrane", "nominal_stress_2=record.nominal_stress[1]", "nominal_stress_2=record.nominal_stress[0]"),
    ("simulate/actuate", "stretch_2=stretch[1]", "stretch_2=stretch[0]"),
    ("simulate/actuate", "nominal_stress_1=values[2]", "nominal_stress_1=values[3]"),
    ("simulate/actuate", "true_field=values[4] * stretch[0] * stretch[1]", "true_field=values[4] * stretch[0] ** 2"),
    ("simulate/actuate", "relative_stretch_1=stretch[0] / begin[0, :, None]", "relative_stretch_1=stretch[0] / begin[1, :, None]"),
    ("simulate/failure_map", "times[Kind.BREAKDOWN], times[Kind.PULL_IN]", "times[Kind.PULL_IN], times[Kind.BREAKDOWN]"),
    ("simulate/lifetime", "float(temperature), pair, slope, intercept", "float(temperature), pair, intercept, slope"),
    ("gent", "1 - 3 * slope", "1 - 2 * slope"),
    ("prony", "np.exp(-t[..., None]", "np.exp(-1.001 * t[..., None]"),
)
ARITHMETIC: dict[type[ast.AST], type[ast.AST]] = {
    **{ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult},
    **{ast.Mod: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd},
}
BOUNDARY: dict[type[ast.AST], type[ast.AST]] = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
NEGATION: dict[type[ast.AST], type[ast.AST]] = {
    **{ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot},
    **{ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In},
}
NAMES = {
    **{"minimum": "maximum", "maximum": "minimum", "min": "max", "max": "min", "argmin": "argmax", "argmax": "argmin"},
    **{"any": "all", "all": "any", "zeros": "ones", "ones": "zeros", "zeros_like": "ones_like", "ones_like": "zeros_like"},
    **{"add": "subtract", "subtract": "add", "multiply": "divide", "divide": "multiply"},
}
SWAPPED = {"divide", "subtract", "interp"}  # calls whose first two arguments may change places; of `where`, the last two


@dataclass(frozen=True)
class Mutant:
    """One change: the module, the line, the kind of change, what stood there and what stands there now."""

    module: str
    line: int
    kind: str
    before: str
    after: str
    tuning: bool
    at_import: bool
    path: tuple[tuple[str, int | None], ...]
    node: ast.AST

    def code(self) -> CodeType:
        """The changed module, compiled."""
        return compile(self.tree(), str(TOP / "dielast" / f"{self.module}.py"), "exec")

    def tree(self) -> ast.Module:
        """The changed module."""
        if isinstance(self.node, ast.Module):
            return self.node
        tree = _parsed(self.module)
        where: ast.AST = tree
        for field, index in self.path[:-1]:
            where = getattr(where, field) if index is None else getattr(where, field)[index]
        _put(where, *self.path[-1], self.node)
        return ast.fix_missing_locations(tree)

    @classmethod
    def stated(cls, module: str, before: str, after: str) -> Mutant:
        """A change of the text itself."""
        text = (TOP / "dielast" / f"{module}.py").read_text("utf-8")
        if before not in text:
            raise SystemExit(f"{module}: {before!r} is not there to be changed")
        line = text[: text.index(before)].count("\n") + 1
        return cls(module, line, "stated", before, after, False, True, (), ast.parse(text.replace(before, after, 1)))

    @property
    def change(self) -> str:
        """The change as `equivalent.txt` names it."""
        return f"{self.module}: {self.before} -> {self.after}"


def variants(node: ast.AST, returned: str) -> Iterator[tuple[str, ast.AST]]:
    """Changed copies of a node and the kinds of change; `returned` is what the function around it returns."""

    def changed(kind: str, change: Callable[[ast.AST], object]) -> tuple[str, ast.AST]:
        other = copy.deepcopy(node)
        change(other)
        return kind, other

    match node:
        case ast.BinOp(op=op) | ast.AugAssign(op=op) if type(op) in ARITHMETIC:
            yield changed("operator", lambda new: setattr(new, "op", ARITHMETIC[type(op)]()))
        case ast.Compare(ops=[op]):
            if type(op) in BOUNDARY:
                yield changed("boundary", lambda new: setattr(new, "ops", [BOUNDARY[type(op)]()]))
            if type(op) in NEGATION:
                yield changed("negation", lambda new: setattr(new, "ops", [NEGATION[type(op)]()]))
        case ast.BoolOp(op=op):
            yield changed("and/or", lambda new: setattr(new, "op", ast.Or() if isinstance(op, ast.And) else ast.And()))
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert(), operand=operand):
            yield "sign" if isinstance(node.op, ast.USub) else "not", copy.deepcopy(operand)
        case ast.Constant(value=bool(value)):
            yield "constant", ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield "constant", ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield "constant", ast.Constant(value * (1 + 1e-3) if value else 1.0)
        case ast.IfExp() | ast.If() | ast.While() if not isinstance(node.test, ast.Compare):
            yield changed("condition", lambda new: setattr(new, "test", ast.UnaryOp(ast.Not(), getattr(new, "test"))))  # noqa: B009
        case ast.Return(value=ast.Tuple(elts=[_, _, *_])):
            yield changed("swap", lambda new: new.value.elts.insert(0, new.value.elts.pop(1)))  # type: ignore[attr-defined]
        case ast.Return(value=ast.expr() as value) if returned in ("Floats", "float", "NDArray[np.float64]"):
            yield "return", ast.Return(ast.BinOp(ast.Constant(1.001), ast.Mult(), copy.deepcopy(value)))
        case ast.Break() | ast.Continue():
            yield "jump", ast.Pass()
    if isinstance(node, ast.AugAssign) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
        yield "deletion", ast.Pass()
    if isinstance(node, ast.Call) and (name := _called(node)):
        if name in NAMES:
            own = "attr" if isinstance(node.func, ast.Attribute) else "id"
            yield changed("call", lambda new: setattr(new.func, own, NAMES[name]))  # type: ignore[attr-defined]
        first = 1 if name == "where" and len(node.args) == 3 else 0
        if (first or name in SWAPPED) and len(node.args) >= first + 2:
            yield changed("swap", lambda new: new.args.insert(first, new.args.pop(first + 1)))  # type: ignore[attr-defined]


def _called(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else call.func.id if isinstance(call.func, ast.Name) else ""


def _silent(field: str, node: ast.AST) -> bool:
    """Whether no change below the node can matter to a number: annotations, messages, decorators, declarations of fields."""
    if field in ("annotation", "returns", "decorator_list", "bases") or isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr):
        return True
    if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
        return True
    if isinstance(node, ast.Call) and _called(node) in ("field", "TypeVar", "errstate", "warn", "catch_warnings", "shown"):
        return True
    return isinstance(node, ast.keyword) and node.arg in ("strict", "kind", "out", "casting", "optimize", "stacklevel")


def _parsed(module: str) -> ast.Module:
    return ast.parse((TOP / "dielast" / f"{module}.py").read_text("utf-8"))


def _put(where: ast.AST, field: str, index: int | None, node: ast.AST) -> None:
    if index is None:
        setattr(where, field, node)
    else:
        getattr(where, field)[index] = node


def mutants(module: str) -> list[Mutant]:
    """All changes of a module."""
    result: list[Mutant] = []

    def visit(parent: ast.AST, path: tuple[tuple[str, int | None], ...], inside: bool, returned: str, tuning: bool) -> None:
        if isinstance(parent, ast.FunctionDef):
            inside = True
            returned = ast.unparse(parent.returns) if parent.returns else ""
        if isinstance(parent, ast.Assign):
            names = {name.id for target in parent.targets for name in ast.walk(target) if isinstance(name, ast.Name)}
            tuning = tuning or names <= TUNING
        for field, value in ast.iter_fields(parent):
            for index, child in enumerate(value) if isinstance(value, list) else [(None, value)]:
                if not isinstance(child, ast.AST) or _silent(field, child):
                    continue
                here = (*path, (field, index))
                for kind, other in variants(child, returned):
                    before = ast.unparse(_shown(parent, child))
                    _put(parent, field, index, ast.copy_location(other, child))
                    after = ast.unparse(_shown(parent, other))
                    _put(parent, field, index, child)
                    number = child.value if isinstance(child, ast.Constant) else None
                    steers = tuning or (isinstance(number, float) and 0 < number <= 1e-4)  # such a number is a tolerance
                    line, at_import = getattr(child, "lineno", 0), not inside
                    result.append(Mutant(module, line, kind, before, after, steers, at_import, here, other))
                visit(child, here, inside, returned, tuning)

    visit(_parsed(module), (), False, "", False)
    return [each for each in result if each.before != each.after]


def _shown(parent: ast.AST, child: ast.AST) -> ast.AST:
    """What is shown of a change: the expression around it, or the condition alone of a compound statement."""
    if isinstance(parent, ast.expr | ast.keyword | ast.Assign | ast.AugAssign | ast.Return):
        return parent
    if isinstance(child, ast.If | ast.While):
        return child.test
    return child


class Changed(SourceFileLoader):
    """Imports one module from a changed tree."""

    def __init__(self, mutant: Mutant) -> None:
        self.mutant = mutant
        super().__init__("dielast." + mutant.module.replace("/", "."), str(TOP / "dielast" / f"{mutant.module}.py"))

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
            cover = coverage.Coverage(data_file=None, source=[str(TOP / "dielast")], config_file=False)
            durations = Durations()

            class Contexts:
                def pytest_runtest_setup(self, item: pytest.Item) -> None:
                    cover.switch_context(item.nodeid)

            cover.start()
            sys.path.insert(0, str(TOP))
            for module in CORE:  # what runs at import is no one test's
                importlib.import_module("dielast." + module.replace("/", "."))
            code = run_tests(TESTS, durations, Contexts())
            cover.stop()
            data, lines = cover.get_data(), {}
            for name in data.measured_files():
                by_line = data.contexts_by_lineno(name)
                module = Path(name).relative_to(TOP / "dielast").with_suffix("").as_posix()
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
    parser.add_argument("modules", nargs="*", default=CORE, help="such as point or simulate/film; by default the core")
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
        every = [mutant for module in arguments.modules for mutant in mutants(module)]
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
