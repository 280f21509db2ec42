"""Colours and line styles that distinguish cases within a panel, and panels for the values of a factor."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from dielast.plots.style import ACROSS, LINES, TEMPERATURES, line_look, row_of, spread_indices
from dielast.plots.texts import number

MOST_LINES = 7  # cases in a panel with different looks
MOST_BANDS = 3  # in a panel: more bands would hide each other
MOST_NAMED = 6  # cases in the legend, if more cases than looks are on no colour scale
DOWN = 4  # panels

Look = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Swept:
    """A swept quantity, a factor of the cases: its `label` on an axis, and its `values` and their `texts` by case.

    Without `values` the quantity is not on a scale.
    """

    label: str
    values: tuple[float, ...] = ()
    texts: tuple[str, ...] = ()

    @property
    def levels(self) -> list[Any]:
        """The distinct values, ascending on a scale, else in the order of the cases."""
        return sorted(set(self.values)) if self.values else list(dict.fromkeys(self.texts))

    def level(self, case: int) -> Any:
        """The level of a case."""
        return self.values[case] if self.values else self.texts[case]

    def text(self, case: int) -> str:
        """The value in a case, for a legend."""
        if self.texts:
            return self.texts[case]
        name, _, unit = self.label.partition(" [")
        return f"{name} = {number(self.values[case])} {unit.rstrip(']')}".rstrip()


@dataclass(frozen=True, slots=True)
class Panel:
    """The `cases` of a panel, each by its number or by its place in a map, and a `title` with what they share."""

    cases: Sequence[Any]
    title: str = ""


@dataclass(frozen=True, slots=True)
class Arrangement:
    """`panels` from left to right, so many `across`; the look of each case; the `width` of all lines; `named`, for each look one
    case and its name in the legend; and the quantity on the colour `scale`, if any.
    """

    panels: Sequence[Panel]
    across: int
    looks: Sequence[Look]
    width: float
    named: Mapping[int, str]
    scale: Swept | None = None

    @property
    def shown(self) -> list[int]:
        """The cases that are drawn."""
        return [case for panel in self.panels for case in panel.cases]


def arrange(labels: Sequence[str], swept: Sequence[Swept], bands: int = 0) -> Arrangement:
    """Arrange the cases with these `labels`; `bands` of them have bands."""
    count, most = len(labels), MOST_BANDS if bands > MOST_BANDS else MOST_LINES
    if count <= most:
        return Arrangement([Panel(range(count))], 1, [line_look(case) for case in range(count)], 1.2, _ordered(labels, swept))
    factors = _crossed(count, swept)
    if len(factors) > 1:
        return _by_factor(factors, most)
    if bands > MOST_BANDS:
        factor = factors[0] if factors else Swept("case", texts=tuple(labels))
        return _by_factor([factor, Swept("", texts=("",) * count)], most)
    if factors and factors[0].values:
        levels = set(_some(factors[0].levels, TEMPERATURES.N))
        told_apart = [case for case in range(count) if factors[0].level(case) in levels]
        return Arrangement([Panel(told_apart)], 1, _scale(factors[0], count), 0.9, {}, factors[0])
    told_apart = spread_indices(count, TEMPERATURES.N)
    named = [told_apart[place] for place in np.unique(np.linspace(0, len(told_apart) - 1, MOST_NAMED).astype(int))]
    looks = [{"color": TEMPERATURES(case / (count - 1)), "linestyle": LINES[case % len(LINES)]} for case in range(count)]
    return Arrangement([Panel(told_apart)], 1, looks, 0.9, {case: labels[case] for case in named})


def _scale(factor: Swept, count: int) -> list[dict[str, Any]]:
    """The looks of the cases by a colour scale."""
    levels = factor.levels
    looks = {
        level: {"color": TEMPERATURES(place / max(1, len(levels) - 1)), "linestyle": "-"} for place, level in enumerate(levels)
    }
    return [looks[factor.level(case)] for case in range(count)]


def _ordered(labels: Sequence[str], swept: Sequence[Swept]) -> dict[int, str]:
    """The labels by case; in ascending order of the swept number if there is only one and it is not monotonic over the cases."""
    cases = list(range(len(labels)))
    if len(swept) == 1 and swept[0].values:
        steps = np.diff(swept[0].values)
        if np.any(steps > 0) and np.any(steps < 0):
            cases.sort(key=lambda case: swept[0].values[case])
    return {case: labels[case] for case in cases}


def _crossed(count: int, swept: Sequence[Swept]) -> list[Swept]:
    """The factors, if every combination of their levels is a case; else a factor with a different level in each case."""
    factors = [factor for factor in swept if len(factor.levels) > 1]
    combinations = {tuple(factor.level(case) for factor in factors) for case in range(count)}
    if len(combinations) == count == int(np.prod([len(factor.levels) for factor in factors])):
        return factors
    telling = [factor for factor in factors if len(factor.levels) == count]
    return sorted(telling, key=lambda factor: not factor.values)[:1]


def _by_factor(factors: Sequence[Swept], most: int) -> Arrangement:
    """Lines for the levels of one factor, that with most levels that fit into a panel; panels for the levels of the others."""
    fitting = [factor for factor in factors if len(factor.levels) <= most or (factor.values and most == MOST_LINES)] or list(
        factors
    )
    lines = max(reversed(fitting), key=lambda factor: len(factor.levels))
    others = sorted((factor for factor in factors if factor is not lines), key=lambda factor: len(factor.levels))
    count = len(lines.values or lines.texts)
    scaled = len(lines.levels) > most and bool(lines.values) and most == MOST_LINES
    along = _some(lines.levels, TEMPERATURES.N if scaled else most)  # a colour scale tells no more apart
    place = {level: number for number, level in enumerate(along)}
    grid = _grid(others)
    panels = []
    for wanted in product(*grid):
        cases = [
            case for case in range(count) if all(factor.level(case) == level for factor, level in zip(others, wanted, strict=True))
        ]
        cases = sorted((case for case in cases if lines.level(case) in place), key=lambda case: place[lines.level(case)])
        panels.append(Panel(cases, ", ".join(factor.text(cases[0]) for factor in others)))
    across = len(grid[1]) if len(grid) == 2 else row_of(len(panels))
    if scaled:
        return Arrangement(panels, across, _scale(lines, count), 0.9, {}, lines)
    looks = [line_look(place.get(lines.level(case), 0)) for case in range(count)]
    named = {case: lines.text(case) for case in panels[0].cases} if lines.label else {}
    return Arrangement(panels, across, looks, 1.2, named)


def _grid(factors: Sequence[Swept]) -> list[list[Any]]:
    """The levels of each factor that panels show: a single factor fills all panels, two factors make rows and columns."""
    if len(factors) == 1:
        return [_some(factors[0].levels, ACROSS * DOWN)]
    if len(factors) == 2:
        return [_some(factor.levels, DOWN) for factor in factors]
    room = max(2, int((ACROSS * DOWN) ** (1 / len(factors))))
    return [_some(factor.levels, room) for factor in factors]


def _some(levels: Sequence[Any], most: int) -> list[Any]:
    """At most `count` levels, evenly spread from the first to the last."""
    return [levels[index] for index in spread_indices(len(levels), most)]
