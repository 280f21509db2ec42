"""Laws of the time over the voltage without physics, to compare with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from dielast.commands.lifetime.recipe import LifetimeRecipe
from dielast.errors import InputError, NumericsError
from dielast.failures.fits import FittedLaw, Lives, fit_law
from dielast.failures.law_models import line_model
from dielast.failures.law_names import LINES
from dielast.failures.likelihood import Seen
from dielast.failures.specimens import Simulated
from dielast.io.table import Column, Table
from dielast.numerics.arrays import Cases

COLUMNS: tuple[tuple[str, str | None, type], ...] = (
    ("law", None, str),
    ("prestretch_1", "1", float),
    ("prestretch_2", "1", float),
    ("specimens", None, np.int64),
    ("failures", None, np.int64),
    ("parameter", None, str),
    ("value", None, float),
    ("standard_error", None, float),
    ("lower", None, float),
    ("upper", None, float),
    ("verdict", None, str),
    ("log_likelihood", "1", float),
)


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Laws of the time over the voltage by name, without physics, of the specimens (rows,) of one prestretch (2,)."""

    fitted: Mapping[tuple[float, float, str], tuple[FittedLaw, Cases]]

    def columns(self) -> Table:
        """A row for each parameter of each law."""
        rows = list[tuple[Any, ...]]()
        for (first, second, name), (law, members) in self.fitted.items():
            model = law.law.model
            for cells in zip(*(column.values for column in law.columns()[:6]), strict=True):
                rows.append((name, first, second, len(members), model.observations.failures, *cells, law.fit.value))
        parts = list(zip(*rows, strict=True)) if rows else [()] * len(COLUMNS)
        return [
            Column(name, unit, list(map(str, values)) if kind is str else np.array(values, dtype=kind))
            for (name, unit, kind), values in zip(COLUMNS, parts, strict=True)
        ]

    def of_lives(self, lives: Lives) -> Table:
        """Columns of `lives`: the time within which a tenth of the films fails by each law, with bounds; none without a law."""
        columns = []
        for name in LINES if self.fitted else ():
            values = np.full((3, lives.voltage.size), np.nan)
            for k in range(lives.voltage.size):
                found = self.fitted.get((*lives.prestretch[k].tolist(), name))
                if found is not None:
                    values[:, k] = found[0].line_life(float(lives.voltage[k]), 0.1)
            for k, end in enumerate(("", "_lower", "_upper")):
                columns.append(Column(f"{name.replace('-', '_')}_time_b10{end}", "s", values[k]))
        return columns


def lines_of(recipe: LifetimeRecipe, tested: Simulated) -> Lines:
    """The laws of each film that failed at several voltages, where they can be fitted."""
    fitted: dict[tuple[float, float, str], tuple[FittedLaw, Cases]] = {}
    specimens = tested.specimens
    for members in _alike(tested):
        alive = tested.end[members] > 0
        members = members[alive & np.isfinite(specimens.voltage[members])]
        failed = members[tested.seen[members] != Seen.SUSPENDED]
        if failed.size < 3 or len(set(np.round(tested.voltage[failed], 6).tolist())) < 2:
            continue
        first, second = specimens.prestretch[members[0]].tolist()
        for name in LINES:
            law = line_model(name, tested, members, recipe.fit.scatter)
            try:
                fit = fit_law(law, level=recipe.uncertainty.level, draws=0, seed=recipe.uncertainty.seed)
            except (InputError, NumericsError):
                continue
            fitted[first, second, name] = fit, members
    return Lines(fitted)


def _alike(tested: Simulated) -> list[Cases]:
    """Specimens of one prestretch, thickness and temperature."""
    specimens = tested.specimens
    keys = [
        (*specimens.prestretch[k].tolist(), float(specimens.thickness[k]), float(specimens.temperature[k]))
        for k in range(len(specimens))
    ]
    return [np.array([k for k, key in enumerate(keys) if key == one]) for one in sorted(set(keys))]
