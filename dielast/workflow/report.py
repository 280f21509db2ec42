"""What a run hands back, and the files it becomes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dielast._version import __version__
from dielast.files import Inputs
from dielast.table import Table, to_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Summary = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Execution:
    """How a run is carried out, which no result depends on: processes, a folder for unfinished work, who hears of progress, the
    Dask scheduler of the cluster to use instead of processes.
    """

    jobs: int = 1
    folder: Path | None = None
    progress: Callable[[int, int], None] | None = None
    scheduler: str | None = None


@dataclass(frozen=True, slots=True)
class Report:
    """A run's results: `tables` by file name, other `files` by name, headline numbers by section, and how to draw the figure.

    `failures` has a line for each case that the numerics could not finish; the tables then hold what was reached.
    """

    tables: Mapping[str, Table]
    headline: Mapping[str, Mapping[str, Any]]
    figure: Callable[[], Figure]
    files: Mapping[str, bytes] = field(default_factory=dict)
    failures: Sequence[str] = ()


def summarise(kind: str, report: Report, inputs: Inputs, recipe: str, warnings: Sequence[str]) -> Summary:
    """The summary: the tool's version, the inputs with their SHA-256, the headline numbers (9 digits), the warnings."""
    summary: dict[str, Any] = {"kind": kind, "version": __version__, "recipe": recipe}
    if warnings:
        summary["warnings"] = list(warnings)
    if report.failures:
        summary["unfinished"] = list(report.failures)
    for section, values in report.headline.items():
        summary[section] = {key: rounded(value) for key, value in values.items() if _known(value)}
    summary["inputs"] = [{"file": name, "sha256": digest} for name, digest in inputs.digests.items()]
    return summary


def contents(kind: str, report: Report, summary: Summary, plots: Sequence[str]) -> dict[str, bytes]:
    """Every file of the run, name -> bytes; `plots` lists the formats wanted."""
    import tomli_w

    files = {name: to_csv(table) for name, table in report.tables.items()}
    files.update(report.files)
    if plots:
        from dielast.plots.style import render

        figure = report.figure()
        files.update({f"{kind}.{form}": render(figure, form) for form in plots})
    # last, so that a whole summary stands for a whole result
    files["summary.toml"] = tomli_w.dumps(dict(summary)).encode()
    return files


def _known(value: Any) -> bool:
    """Whether there is a value: a standard error that the data do not determine is left out."""
    return value is not None and not (isinstance(value, float) and not math.isfinite(value))


def rounded(value: Any) -> Any:
    """Numbers to 9 significant digits, as in the tables."""
    if isinstance(value, float):
        return float(f"{value:.9g}")
    if isinstance(value, list | tuple):
        return [rounded(entry) for entry in value]
    return value
