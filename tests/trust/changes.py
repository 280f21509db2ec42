"""Changes of one place in the source of dielast, for `mutate.py`: what stands there and what stands there instead."""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import CodeType

PACKAGE = Path(__file__).resolve().parents[2] / "dielast"
CORE = (
    *("gent", "kinematics", "point", "symmetric", "jump", "stability", "events", "integrate", "rosenbrock", "roots", "load"),
    *("shift", "prony", "material"),
    *(f"simulate/{name}" for name in ("actuate", "creep", "failure_map", "film", "history", "lifetime", "membrane", "output")),
    *(f"simulate/{name}" for name in ("relax", "setup", "trace", "voltage")),
    *(f"characterise/{name}" for name in ("schwarzl_staverman", "shiftfit", "curve")),
)
FITTING = (
    *(f"characterise/{name}" for name in ("mastercurve", "masterfit", "spectrum", "nnls", "binning", "overlap", "oscillation")),
    "characterise/interconversion",
)
GROUPS = {"core": CORE, "fitting": FITTING}
SHORT = 5  # characters of a text that does not tell one place from another, such as -1 or -0.25
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
        return compile(self.tree(), str(PACKAGE / f"{self.module}.py"), "exec")

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
        text = (PACKAGE / f"{module}.py").read_text("utf-8")
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

    def changed(kind: str, **fields: object) -> tuple[str, ast.AST]:
        other = copy.deepcopy(node)
        for field, value in fields.items():
            setattr(other, field, value)
        return kind, other

    match node:
        case ast.BinOp(op=op) | ast.AugAssign(op=op) if type(op) in ARITHMETIC:
            yield changed("operator", op=ARITHMETIC[type(op)]())
        case ast.Compare(ops=[op]):
            if type(op) in BOUNDARY:
                yield changed("boundary", ops=[BOUNDARY[type(op)]()])
            if type(op) in NEGATION:
                yield changed("negation", ops=[NEGATION[type(op)]()])
        case ast.BoolOp(op=op):
            yield changed("and/or", op=ast.Or() if isinstance(op, ast.And) else ast.And())
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert(), operand=operand):
            yield "sign" if isinstance(node.op, ast.USub) else "not", copy.deepcopy(operand)
        case ast.Constant(value=bool(value)):
            yield "constant", ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield "constant", ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield "constant", ast.Constant(value * (1 + 1e-3) if value else 1.0)
        case ast.IfExp(test=test) | ast.If(test=test) | ast.While(test=test) if not isinstance(test, ast.Compare):
            yield changed("condition", test=ast.UnaryOp(ast.Not(), copy.deepcopy(test)))
        case ast.Return(value=ast.Tuple(elts=[first, second, *others])):
            yield changed("swap", value=ast.Tuple(copy.deepcopy([second, first, *others]), ast.Load()))
        case ast.Return(value=ast.expr() as value) if returned in ("Floats", "float", "NDArray[np.float64]"):
            yield "return", ast.Return(ast.BinOp(ast.Constant(1.001), ast.Mult(), copy.deepcopy(value)))
        case ast.Break() | ast.Continue():
            yield "jump", ast.Pass()
    if isinstance(node, ast.AugAssign) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
        yield "deletion", ast.Pass()
    if isinstance(node, ast.Call) and (name := _called(node)):
        if name in NAMES:
            yield changed("call", func=_renamed(node.func, NAMES[name]))
        place = 1 if name == "where" and len(node.args) == 3 else 0
        if (place or name in SWAPPED) and len(node.args) >= place + 2:
            args = copy.deepcopy(node.args)
            args.insert(place, args.pop(place + 1))
            yield changed("swap", args=args)


def _renamed(function: ast.expr, name: str) -> ast.expr:
    if isinstance(function, ast.Attribute):
        return ast.Attribute(copy.deepcopy(function.value), name, ast.Load())
    return ast.Name(name, ast.Load())


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
    return ast.parse((PACKAGE / f"{module}.py").read_text("utf-8"))


def _put(where: ast.AST, field: str, index: int | None, node: ast.AST) -> None:
    if index is None:
        setattr(where, field, node)
    else:
        getattr(where, field)[index] = node


def mutants(module: str) -> list[Mutant]:
    """All changes of a module."""
    result: list[Mutant] = []

    def visit(
        parents: tuple[ast.AST, ...], path: tuple[tuple[str, int | None], ...], inside: bool, returned: str, tuning: bool
    ) -> None:
        parent = parents[-1]
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
                around = _around(parents)
                for kind, other in variants(child, returned):
                    before = ast.unparse(around or _condition(child))
                    _put(parent, field, index, ast.copy_location(other, child))
                    after = ast.unparse(around or _condition(other))
                    _put(parent, field, index, child)
                    number = child.value if isinstance(child, ast.Constant) else None
                    steers = tuning or (isinstance(number, float) and 0 < number <= 1e-4)  # such a number is a tolerance
                    line, at_import = getattr(child, "lineno", 0), not inside
                    result.append(Mutant(module, line, kind, before, after, steers, at_import, here, other))
                visit((*parents, child), here, inside, returned, tuning)

    visit((_parsed(module),), (), False, "", False)
    return [each for each in result if each.before != each.after]


def _around(parents: tuple[ast.AST, ...]) -> ast.AST | None:
    """The innermost expression around a change whose text is long enough to tell which place is meant."""
    around = None
    for node in reversed(parents):
        if not isinstance(node, ast.expr | ast.keyword | ast.Assign | ast.AugAssign | ast.Return):
            break
        around = node
        if len(ast.unparse(node)) > SHORT:
            break
    return around


def _condition(node: ast.AST) -> ast.AST:
    """The condition alone of a compound statement."""
    return node.test if isinstance(node, ast.If | ast.While) else node
