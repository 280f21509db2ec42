"""`sensitivity = true`: tables, summary and warnings on what drives the life of films."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from dielast.commands.simulation.uncertainty_recipe import Uncertainty
from dielast.errors import InputError, warn
from dielast.io.table import Column, Table
from dielast.material.material import Material
from dielast.material.scatter import Sample
from dielast.simulate.sensitivity import LifeShares, Sensitivity, Variation, variation_for

SENSITIVITY = "sensitivity"


def variation_of(material: Material, sample: Sample | None, stated: Uncertainty | None) -> Variation:
    """The films to solve: with draws, exchanges of sources between them; else the material with one constant changed at a time."""
    try:
        return variation_for(material, sample, 1 if stated is None else stated.seed)
    except InputError as error:
        raise error.changed(lambda problem: problem.in_keys({"sample": SENSITIVITY})) from None


def table_of(results: Sequence[Sensitivity]) -> Table:
    """The tables of several results, which are all of one kind, one below the other."""
    tables = [result.columns() for result in results]
    return [
        Column(first.name, first.unit, _one_below_the_other([table[place].values for table in tables]))
        for place, first in enumerate(tables[0])
    ]


def _one_below_the_other(values: Sequence[Any]) -> Any:
    return np.concatenate(values) if isinstance(values[0], np.ndarray) else [text for part in values for text in part]


def headline_of(results: Sequence[Sensitivity]) -> dict[str, dict[str, Any]]:
    """The section of the summary: the numbers of films with and without a sensitivity."""
    what, films, left_out = _counted(results)
    return {SENSITIVITY: {what: films, "left_out": left_out}}


def warn_of_left_out(results: Sequence[Sensitivity]) -> None:
    """Warn of films that have draws without a time to failure."""
    what, films, left_out = _counted(results)
    if left_out:
        runs = "draws" if isinstance(results[0], LifeShares) else "changes"
        none = f"{left_out} of {films} {what} have no sensitivity: some of their {runs} survive, fail at once, or were not finished"
        warn(f"{none}; state a longer time or a higher voltage", key=SENSITIVITY)


def _counted(results: Sequence[Sensitivity]) -> tuple[str, int, int]:
    """The plural name of the films of the results, their number, and the number of films without a sensitivity."""
    films = results[0].films
    what = "cases" if films[0].name == "case" else "cells"
    return what, sum(len(result.films[0].values) for result in results), sum(result.left_out for result in results)
