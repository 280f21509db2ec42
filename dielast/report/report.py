"""The result of a run, and the files that are made from it."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dielast.io.files import Inputs, sha256
from dielast.io.table import Table, rounded, to_csv
from dielast.registry import adopted

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Summary = Mapping[str, Any]
FIGURES = ("png", "svg", "pdf")


@dataclass(frozen=True, slots=True)
class Report:
    """The result of a run: `tables` and other `files` by name, headline numbers by section, and a function that draws the figure.

    `failures` has a line for each case that the solver could not finish; its table then ends at the last solved time.
    """

    tables: Mapping[str, Table]
    headline: Mapping[str, Mapping[str, Any]]
    figure: Callable[[], Figure]
    files: Mapping[str, bytes] = field(default_factory=dict)
    failures: Sequence[str] = ()
    figures: Mapping[str, Callable[[], Figure]] = field(default_factory=dict)
    """Further figures by name."""
    interrupted: bool = False
    """Whether Ctrl-C ended the run early, so that the result is incomplete."""


@dataclass(frozen=True, slots=True)
class RecipeSource:
    """The recipe of a run: the name of its file, the content if known, and the keys set on the command line."""

    name: str
    content: bytes | None = None
    settings: Sequence[str] = ()


def summarise(kind: str, report: Report, inputs: Inputs, source: RecipeSource, warnings: Sequence[str], version: str) -> Summary:
    """The summary: `version` of dielast, recipe and inputs with their SHA-256, the headline numbers (9 digits), the warnings."""
    summary: dict[str, Any] = {"kind": kind, "version": version, "recipe": source.name}
    if source.settings:
        summary["set"] = list(source.settings)
    if warnings:
        summary["warnings"] = list(warnings)
    if report.failures:
        summary["unfinished"] = list(report.failures)
    if report.interrupted:
        summary["interrupted"] = True
    if packages := [f"{package}: {name} of {group}" for group, name, package in adopted()]:
        summary["packages"] = packages
    for section, values in report.headline.items():
        summary[section] = {key: rounded(value) for key, value in values.items() if _known(value)}
    recipe = () if source.content is None else ((source.name, sha256(source.content)),)
    summary["inputs"] = [{"file": name, "sha256": digest} for name, digest in (*recipe, *inputs.digests)]
    return summary


def contents(kind: str, report: Report, summary: Summary, plots: Sequence[str]) -> dict[str, bytes]:
    """Every file of the run, name -> bytes; `plots` lists the formats wanted."""
    import tomli_w

    files = {name: to_csv(table) for name, table in report.tables.items()}
    files.update(report.files)
    if plots:
        for name, draw in {kind: report.figure, **report.figures}.items():
            figure = draw()
            files.update({f"{name}.{form}": _saved(figure, form) for form in plots})
    # written last: a folder with a summary then holds a complete result
    files["summary.toml"] = tomli_w.dumps(dict(summary)).encode()
    return files


def _saved(figure: Figure, form: str) -> bytes:
    """The figure as png, svg or pdf."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=form)
    return buffer.getvalue()


def left_over(folder: Path, names: Collection[str], kind: str, written: Collection[str]) -> list[str]:
    """Files in the `folder` that an earlier run of the same `kind` wrote there and this run did not.

    `names` are those of all files that the kind may write, besides its figures.
    """
    known = (*names, *(f"{kind}.{form}" for form in FIGURES))
    return [name for name in known if name not in written and (folder / name).is_file()]


def _known(value: Any) -> bool:
    """Whether there is a value; None, NaN and infinity, such as an undetermined standard error, are left out."""
    return value is not None and not (isinstance(value, float) and not math.isfinite(value))
