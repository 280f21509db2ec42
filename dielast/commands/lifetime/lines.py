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
from dielast.numerics.arrays import Cases, Floats

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
    ("thickness", "m", float),
    ("temperature", "degC", float),
)
Key = tuple[float, float, float, float]
"""What films share: both prestretches, the thickness in m and the temperature in degC."""


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Laws of the time over the voltage by name, without physics, of the specimens (rows,) of one kind of film."""

    fitted: Mapping[tuple[Key, str], tuple[FittedLaw, Cases]]

    def columns(self) -> Table:
        """A row for each parameter of each law."""
        rows = list[tuple[Any, ...]]()
        for ((*pair, thickness, temperature), name), (law, members) in self.fitted.items():
            model = law.law.model
            for cells in zip(*(column.values for column in law.columns()[:6]), strict=True):
                count = len(members), model.observations.failures
                rows.append((name, *pair, *count, *cells, law.fit.value, thickness, temperature))
        parts = list(zip(*rows, strict=True)) if rows else [()] * len(COLUMNS)
        return [
            Column(name, unit, list(map(str, values)) if kind is str else np.array(values, dtype=kind))
            for (name, unit, kind), values in zip(COLUMNS, parts, strict=True)
        ]

    def lives(self, name: str, lives: Lives, thickness: float, temperature: float, share: float) -> Floats:
        """The times (3, films) in s within which a share of the films of `lives` fails by a law, and its bounds; NaN without it."""
        values = np.full((3, lives.voltage.size), np.nan)
        for k in range(lives.voltage.size):
            first, second = lives.prestretch[k].tolist()
            found = self.fitted.get(((first, second, thickness, temperature), name))
            if found is not None:
                values[:, k] = found[0].line_life(float(lives.voltage[k]), share)
        return values

    def of_lives(self, lives: Lives, thickness: float, temperature: float) -> Table:
        """Columns of `lives`, of films of a thickness in m at a temperature in degC: the time within which a tenth of the films
        fails by each law, with bounds; none without a law.
        """
        columns = []
        for name in LINES if self.fitted else ():
            values = self.lives(name, lives, thickness, temperature, 0.1)
            for k, end in enumerate(("", "_lower", "_upper")):
                columns.append(Column(f"{name.replace('-', '_')}_time_b10{end}", "s", values[k]))
        return columns


def lines_of(recipe: LifetimeRecipe, tested: Simulated) -> Lines:
    """The laws of each kind of film that failed at several voltages, where they can be fitted."""
    fitted: dict[tuple[Key, str], tuple[FittedLaw, Cases]] = {}
    specimens = tested.specimens
    columns = (*specimens.prestretch.T, specimens.thickness, specimens.temperature)
    keys: list[Key] = list(zip(*(column.tolist() for column in columns), strict=True))
    for film in sorted(set(keys)):
        members = np.array([k for k, key in enumerate(keys) if key == film])
        alive = tested.end[members] > 0
        members = members[alive & np.isfinite(specimens.voltage[members])]
        failed = members[tested.seen[members] != Seen.SUSPENDED]
        if failed.size < 3 or len(set(np.round(tested.voltage[failed], 6).tolist())) < 2:
            continue
        for name in LINES:
            law = line_model(name, tested, members, recipe.fit.scatter)
            try:
                fit = fit_law(law, level=recipe.uncertainty.level, draws=0, seed=recipe.uncertainty.seed)
            except (InputError, NumericsError):
                continue
            fitted[film, name] = fit, members
    return Lines(fitted)
