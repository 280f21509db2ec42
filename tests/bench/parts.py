"""What benches share: seconds that jobs take, and parts: what each experiment gave is a line of a file, so that runs of different
experiments add up.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

Result = TypeVar("Result")


def timed(job: Callable[[], Result]) -> tuple[Result, float]:
    """The result of a job, and the seconds that it took."""
    begin = time.perf_counter()
    result = job()
    return result, time.perf_counter() - begin


def clock(job: Callable[[], object]) -> float:
    """The seconds that a job takes."""
    return timed(job)[1]


def seconds(*jobs: Callable[[], object], repeats: int = 7) -> list[float]:
    """Median time of each job, runs interleaved."""
    return np.median([[clock(job) for job in jobs] for _ in range(repeats)], axis=0).tolist()


def arguments(parser: argparse.ArgumentParser, experiments: int, first: int = 0) -> None:
    """The options `--first` and `--laboratories`, and `--file` for the lines."""
    parser.add_argument("--first", type=int, default=first, help="number of the first laboratory")
    parser.add_argument("--laboratories", type=int, default=experiments)
    parser.add_argument("--file", type=Path, help="add a line for each laboratory; with 0 laboratories, count those that it has")


def add(path: Path | None, key: str, number: int, found: Mapping[str, Any]) -> None:
    """Add what the experiment `number` of the kind `key` gave."""
    if path is not None:
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"key": key, "number": number, **found}) + "\n")


def read(path: Path, key: str) -> dict[int, dict[str, Any]]:
    """What all experiments of the kind `key` gave, by their numbers; of two lines of one number, the later one counts."""
    lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.is_file() else []
    return {line["number"]: line for line in sorted(lines, key=lambda line: line["number"]) if line["key"] == key}
