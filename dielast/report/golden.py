"""Compare a result with a golden one: every table cell and summary number, within a relative tolerance.

A golden folder may hold a `tolerance.toml` with other tolerances for columns of a table or numbers of the summary: a relative
tolerance, or `{ rtol = ..., atol = ... }` with an absolute tolerance in the unit of the column.

    ["failure-map.csv"]
    "time_to_failure [s]" = 1e-4
    ["summary.toml"]
    "fit.rms_relative_error" = { rtol = 1e-3, atol = 1e-9 }

A strain of a table is compared as the stretch to which it belongs, unless its tolerance is stated: near zero, two strains differ by
the errors of that stretch.
"""

import math
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from dielast.base.errors import InputError, located
from dielast.io.files import read_file
from dielast.io.manifest import SUMMARY, altered, not_of_the_run
from dielast.io.spool import Content
from dielast.io.table import as_number, parse_csv
from dielast.io.toml import parse_toml

# numbers this far below the largest of their column are rounding errors, and their ratios mean nothing
NEGLIGIBLE = 1e-12
TOLERANCES = "tolerance.toml"
STRAIN = re.compile(r"strain(_lower|_upper)? \[1\]$")
STRETCH = 1e-6  # the most by which strains near zero differ as the stretches to which they belong do


class Tolerance(NamedTuple):
    """The allowed difference of two numbers: relative to the larger one, or absolute."""

    rtol: float
    atol: float = 0.0

    def holds(self, a: float, b: float, floor: float = 0.0) -> bool:
        """Whether `a` and `b` agree within the tolerance; numbers that differ by less than `floor` always do."""
        return a == b or abs(a - b) <= max(self.rtol * max(abs(a), abs(b)), self.atol, floor)


def differences(contents: Mapping[str, Content], golden: Path, rtol: float) -> list[str]:
    """One line for each column of `contents` (name -> bytes) with cells that differ from those in the folder `golden` by more than
    `rtol`, or than the folder's tolerance for them: their number, and the cell that differs most.

    Tables and `summary.toml` are compared; a table or a row that only one side has is a difference, and so is a column that only
    the golden table has. Columns that the golden table lacks, plots, digests and versions are not compared. Raises `InputError` if
    there is nothing to compare with, or if the tolerances cannot be read.
    """
    expected = golden_files(golden)
    special = tolerances(golden, expected)
    lines: list[str] = []
    for name in sorted(expected.keys() | {name for name in contents if _compared(name)}):
        if name not in contents:
            lines.append(f"{name}: not in this result")
        elif name not in expected:
            lines.append(f"{name}: not among the golden files")
        elif name == "summary.toml":
            lines += _summaries(bytes(contents[name]), expected[name], Tolerance(rtol), special.get(name, {}))
        else:
            lines += _tables(name, bytes(contents[name]), expected[name], Tolerance(rtol), special.get(name, {}))
    return lines


def foreign(golden: Path) -> str:
    """A message on files of the folder `golden` that are not those of the run that its summary is of; empty if there are none."""
    files = golden_files(golden)
    contents = {name: read_file(path, str(path)) for name, path in files.items()}
    if SUMMARY not in contents:
        return ""
    others = altered(parse_toml(contents[SUMMARY], str(files[SUMMARY])), contents)
    return not_of_the_run(others) if others else ""


def golden_files(golden: Path) -> dict[str, Path]:
    """The files of the folder `golden` that are compared, by name; raises `InputError` if there are none."""
    if not os.path.isdir(golden):
        raise InputError("no such folder of golden files", file=golden)
    try:
        names = sorted(os.listdir(golden))
    except OSError as error:
        raise InputError(f"cannot be read: {(error.strerror or str(error)).lower()}", file=golden) from None
    files = {name: golden / name for name in names if _compared(name) and os.path.isfile(golden / name)}
    if not files:
        raise InputError("no tables and no summary.toml to compare with", file=golden)
    return files


def tolerances(golden: Path, files: Mapping[str, Path]) -> dict[str, dict[str, Tolerance]]:
    """The tolerances that the folder `golden` states, by file and column or key; none where it states none.

    Raises `InputError` for an unknown file or column, and for a value that is not a tolerance.
    """
    path = golden / TOLERANCES
    if not os.path.isfile(path):
        return {}
    result: dict[str, dict[str, Tolerance]] = {}
    for name, columns in parse_toml(read_file(path, str(path)), str(path)).items():
        if name not in files:
            raise InputError(f"no such golden file; there are {', '.join(files)}", file=path, key=name)
        if not isinstance(columns, Mapping):
            raise InputError("a table of tolerances by column is needed", file=path, key=name)
        content = read_file(files[name], str(files[name]))
        known = _flat(parse_toml(content, str(files[name]))) if name == "summary.toml" else parse_csv(content, str(files[name]))
        result[name] = {}
        for column, value in columns.items():
            if column not in known:
                raise InputError(f'no "{column}" to compare in this file', file=path, key=name)
            with located(file=path, key=f'{name}: "{column}"'):
                result[name][column] = _tolerance(value)
    return result


def _tolerance(value: Any) -> Tolerance:
    stated = value if isinstance(value, Mapping) else {"rtol": value}
    if not stated or not stated.keys() <= {"rtol", "atol"}:
        raise InputError("rtol, atol or both are needed, such as { rtol = 1e-4, atol = 1e-9 }")
    for key, number in stated.items():
        if isinstance(number, bool) or not isinstance(number, int | float) or not 0 <= number < math.inf:
            raise InputError(f"{key} = {number}: a number of at least 0 is needed")
    return Tolerance(float(stated.get("rtol", 0.0)), float(stated.get("atol", 0.0)))


def _compared(name: str) -> bool:
    return name.endswith(".csv") or name == "summary.toml"


def _tables(name: str, content: bytes, golden: Path, usual: Tolerance, special: Mapping[str, Tolerance]) -> Iterator[str]:
    now, then = parse_csv(content, name), parse_csv(read_file(golden, str(golden)), str(golden))
    # a column that a later version adds is not a difference
    if [header for header in now if header in then] != list(then):
        yield f"{name}: columns {', '.join(now)}; golden {', '.join(then)}"
        return
    for header in then:
        cells = now[header]
        if len(cells) != len(then[header]):
            yield f"{name}: {len(cells)} rows; golden {len(then[header])}"
            return
        expected = list(map(as_number, then[header]))
        tolerance = special.get(header, usual)
        floor = NEGLIGIBLE * max(map(abs, filter(math.isfinite, expected)), default=0.0)
        if STRAIN.search(header) and header not in special:
            floor = max(floor, min(usual.rtol, STRETCH))
        apart = []
        for row, (a, b, y) in enumerate(zip(cells, then[header], expected, strict=True)):
            x = as_number(a)
            numbers = math.isfinite(x) and math.isfinite(y)
            if not (tolerance.holds(x, y, floor) if numbers else a == b):
                apart.append((_relative(x, y) if numbers else math.inf, f"row {row + 2}: {a or 'empty'}; golden {b or 'empty'}"))
        if apart:
            yield f"{name}: {header}: {_most(apart, len(cells), 'cells')}"


def _summaries(content: bytes, golden: Path, usual: Tolerance, special: Mapping[str, Tolerance]) -> Iterator[str]:
    now, then = _flat(parse_toml(content, "summary.toml")), _flat(parse_toml(read_file(golden, str(golden)), str(golden)))
    apart: dict[str, list[tuple[float, str]]] = {}
    counts = Counter(key.partition("[")[0] for key in now.keys() | then.keys())
    for key in sorted(now.keys() | then.keys()):
        a, b = now.get(key), then.get(key)
        if a is None or b is None or not special.get(key, usual).holds(a, b):
            path, _, place = key.partition("[")
            text = f"{'missing' if a is None else a}; golden {'missing' if b is None else b}"
            by = math.inf if a is None or b is None else _relative(a, b)
            apart.setdefault(path, []).append((by, f"[{place}: {text}" if place else text))
    for path, found in apart.items():
        yield f"summary.toml: {path}: {_most(found, counts[path], 'numbers')}"


def _relative(a: float, b: float) -> float:
    """The difference over the larger magnitude."""
    return abs(a - b) / max(abs(a), abs(b)) if a != b else 0.0


def _most(apart: Sequence[tuple[float, str]], count: int, what: str) -> str:
    """The line about entries that differ, of so many in all: the relative difference of the one that differs most, and its text."""
    by, text = max(apart, key=lambda entry: entry[0])
    relative = f", relative difference {by:.2g}" if math.isfinite(by) else ""
    if count == 1:
        return text + relative
    differ = "differs:" if len(apart) == 1 else "differ, most"
    return f"{len(apart)} of {count} {what} {differ} {text}{relative}"


def _flat(value: Any, path: str = "") -> dict[str, float]:
    """The finite numbers of a summary by their key path; another number is one that is not known, as a word in its place is."""
    if isinstance(value, bool | str):
        return {}
    if isinstance(value, int | float):
        return {path: float(value)} if math.isfinite(value) else {}
    if isinstance(value, dict):
        return {key: number for name, inner in value.items() for key, number in _flat(inner, f"{path}.{name}".lstrip(".")).items()}
    if isinstance(value, list):
        return {key: number for index, inner in enumerate(value) for key, number in _flat(inner, f"{path}[{index}]").items()}
    return {}
