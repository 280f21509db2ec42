"""The result of a run, and the files that are made from it."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dielast.base.errors import warn
from dielast.base.registry import adopted
from dielast.io.files import Inputs, sha256
from dielast.io.manifest import FIGURES, LISTED, listing, mark
from dielast.io.spool import Content, content_of
from dielast.io.table import Table, csv_blocks, rounded

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Summary = Mapping[str, Any]
UNDETERMINED = "undetermined"
"""What a list of a summary says in the place of a number that is not known."""


@dataclass(frozen=True, slots=True)
class RunReport:
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


def written(report: RunReport) -> dict[str, Content]:
    """Tables and other files of the run, name -> bytes."""
    return {name: content_of(csv_blocks(table)) for name, table in report.tables.items()} | dict(report.files)


def summarise(
    kind: str, report: RunReport, files: Mapping[str, Content], inputs: Inputs, source: RecipeSource, version: str
) -> dict[str, Any]:
    """The summary without warnings: `version` of dielast, recipe, inputs and `files` with their SHA-256, the headline numbers (9
    digits).
    """
    summary: dict[str, Any] = {"kind": kind, "version": version, "recipe": source.name}
    if source.settings:
        summary["set"] = list(source.settings)
    if report.failures:
        summary["unfinished"] = list(report.failures)
    if report.interrupted:
        summary["interrupted"] = True
    if packages := [f"{package}: {name} of {group}" for group, name, package in adopted()]:
        summary["packages"] = packages
    for section, values in report.headline.items():
        summary[section] = _stated(values)
    recipe = () if source.content is None else ((source.name, sha256(source.content)),)
    summary["inputs"] = [{"file": name, "sha256": digest} for name, digest in (*recipe, *inputs.digests)]
    summary[LISTED] = listing(files)
    return summary


def drawn(kind: str, report: RunReport, plots: Sequence[str], summary: Summary) -> dict[str, bytes]:
    """The figures of the run with this `summary`, name -> bytes; `plots` lists the formats wanted.

    A figure that cannot be drawn is left out with a warning: it costs no result.
    """
    files = {}
    for name, draw in {kind: report.figure, **report.figures}.items() if plots else ():
        try:
            figure = draw()
            files.update({f"{name}.{form}": _saved(figure, form, mark(summary)) for form in plots})
        except Exception as error:
            warn(f"the figure {name} cannot be drawn and is left out ({type(error).__name__}: {error})")
    return files


def with_warnings(summary: Summary, warnings: Sequence[str]) -> Summary:
    """The summary with the warnings of the run, before its sections."""
    first = {key: summary[key] for key in ("kind", "version", "recipe", "set") if key in summary}
    return first | ({"warnings": list(warnings)} if warnings else {}) | dict(summary)


def _saved(figure: Figure, form: str, run: str) -> bytes:
    """The figure as png, svg or pdf, with the mark of its `run`."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format=form, metadata={"Keywords" if form == "pdf" else "Source": run})
    return buffer.getvalue()


def left_over(folder: Path, names: Collection[str], kind: str, written: Collection[str]) -> list[str]:
    """Files in the `folder` that an earlier run of the same `kind` wrote there and this run did not.

    `names` are those of all files that the kind may write, besides its figures.
    """
    known = (*names, *(f"{kind}.{form}" for form in FIGURES))
    return [name for name in known if name not in written and (folder / name).is_file()]


def _stated(value: Any) -> Any:
    """What a summary states of a value: numbers to 9 digits. None, NaN and infinity, such as an undetermined standard error, are
    left out; in a list of which other entries are known, the word `UNDETERMINED` keeps their place.
    """
    if isinstance(value, Mapping):
        return {key: stated for key, each in value.items() if (stated := _stated(each)) is not None}
    if isinstance(value, list | tuple):
        entries = [_stated(each) for each in value]
        if entries and all(each is None for each in entries):
            return None
        return [UNDETERMINED if each is None else each for each in entries]
    return None if isinstance(value, float) and not math.isfinite(value) else rounded(value)
