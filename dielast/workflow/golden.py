"""Compare a result with a golden one: every table cell and summary number, within a relative tolerance."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from dielast.errors import InputError
from dielast.recipe.validate import parse_toml
from dielast.table import parse_csv

# a number this far below the largest of its column is rounding, and no ratio of two such numbers means anything
NEGLIGIBLE = 1e-12


def differences(contents: Mapping[str, bytes], golden: Path, rtol: float) -> list[str]:
    """One line for each cell of `contents` (name -> bytes) that differs from the folder `golden` by more than `rtol`.

    Tables and `summary.toml` are compared; a table or a row that only one side has is a difference. Plots, digests and versions are
    not compared. Raises `InputError` if there is nothing to compare with.
    """
    expected = golden_files(golden)
    lines: list[str] = []
    for name in sorted(expected.keys() | {name for name in contents if _compared(name)}):
        if name not in contents:
            lines.append(f"{name}: not in this result")
        elif name not in expected:
            lines.append(f"{name}: not among the golden files")
        elif name == "summary.toml":
            lines += _summaries(contents[name], expected[name], rtol)
        else:
            lines += _tables(name, contents[name], expected[name], rtol)
    return lines


def golden_files(golden: Path) -> dict[str, Path]:
    """The files of the folder `golden` that are compared, by name; raises `InputError` if there are none."""
    if not golden.is_dir():
        raise InputError(f"{golden}: no such folder of golden files")
    found = {path.name: path for path in sorted(golden.iterdir()) if _compared(path.name)}
    if not found:
        raise InputError(f"{golden}: no tables and no summary.toml to compare with")
    return found


def _compared(name: str) -> bool:
    return name.endswith(".csv") or name == "summary.toml"


def _tables(name: str, content: bytes, golden: Path, rtol: float) -> Iterator[str]:
    now, then = parse_csv(content, name), parse_csv(golden.read_bytes(), str(golden))
    if list(now) != list(then):
        yield f"{name}: columns {', '.join(now)}; golden {', '.join(then)}"
        return
    for header, cells in now.items():
        if len(cells) != len(then[header]):
            yield f"{name}: {len(cells)} rows; golden {len(then[header])}"
            return
        numbers = [(_number(a), _number(b)) for a, b in zip(cells, then[header], strict=True)]
        floor = NEGLIGIBLE * max((abs(b) for _, b in numbers if b is not None), default=0.0)
        for row, (a, b) in enumerate(zip(cells, then[header], strict=True)):
            x, y = numbers[row]
            same = _close(x, y, rtol, floor) if x is not None and y is not None else a == b
            if not same:
                yield f"{name}: row {row + 2}: {header}: {a or 'empty'}; golden {b or 'empty'}"


def _summaries(content: bytes, golden: Path, rtol: float) -> Iterator[str]:
    now, then = _flat(parse_toml(content, "summary.toml")), _flat(parse_toml(golden.read_bytes(), str(golden)))
    for key in sorted(now.keys() | then.keys()):
        a, b = now.get(key), then.get(key)
        if a is None or b is None or not _close(a, b, rtol, 0.0):
            yield f"summary.toml: {key}: {'missing' if a is None else a}; golden {'missing' if b is None else b}"


def _flat(value: Any, path: str = "") -> dict[str, float]:
    """The numbers of a summary by their key path."""
    if isinstance(value, bool | str):
        return {}
    if isinstance(value, int | float):
        return {path: float(value)}
    if isinstance(value, dict):
        return {key: number for name, inner in value.items() for key, number in _flat(inner, f"{path}.{name}".lstrip(".")).items()}
    if isinstance(value, list):
        return {key: number for index, inner in enumerate(value) for key, number in _flat(inner, f"{path}[{index}]").items()}
    return {}


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _close(a: float, b: float, rtol: float, floor: float) -> bool:
    return abs(a - b) <= max(rtol * max(abs(a), abs(b)), floor)
