"""What drives the life of films: bars of shares in its variance, or of its derivatives."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from dielast.plots.style import COLOURS, grid, legend_below, say, sheet, spread_indices, style
from dielast.plots.texts import degrees, number, prestretched, unit_for
from dielast.simulate.sensitivity import LifeShares, Sensitivity

MOST_PANELS = 6
LONGEST_TITLE = 34  # characters of a line
ROW = 0.24  # inches for each source
FIRST: Any = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.7}
TOTAL: Any = {"facecolor": COLOURS[2], "edgecolor": "black", "linewidth": 0.7}
BAR = 0.38  # share of the height of a row


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A film of a result, and the title of its panel."""

    result: Sensitivity
    film: int
    title: str


def plot_sensitivity(results: Sensitivity | Sequence[Sensitivity], title: str | None = None, labels: Sequence[str] = ()) -> Figure:
    """A panel of bars for each film, at most six; for a film at several voltages, the middle one of those with a known result.

    The results must be of one kind. `labels` are the names of cases, if the films are cases.
    """
    every = list(results) if isinstance(results, Sequence) else [results]
    films = [shown for result in every for shown in _shown(result, labels)]
    films = [films[place] for place in spread_indices(len(films), MOST_PANELS)]
    shares = bool(every) and isinstance(every[0], LifeShares)
    rows = _rows(films)
    with style():
        across = min(2, max(1, len(films)))
        down = -(-max(1, len(films)) // across)
        figure = sheet(title, across, down * (0.95 + ROW * max(2, len(rows))) + 0.3)
        all_axes = grid(figure, max(1, len(films)), across, sharey=True, sharex=True)
        if not films:
            say(all_axes[0], "too few failures for a result")
        for place, (axes, shown) in enumerate(zip(all_axes, films, strict=False)):
            _bars(axes, shown, rows)
            called = " ".join([f"({'abcdef'[place]})"] * (len(films) > 1) + [shown.title])
            lines = [line for part in called.splitlines() for line in textwrap.wrap(part, LONGEST_TITLE)]
            axes.set_title("\n".join(lines), loc="left", fontsize=7.5)
            axes.axvline(0, color="black", linewidth=0.7)
        name = "share of the variance of log life" if shares else "change of the life [%]\nfor 1 % of the constant"
        for axes in all_axes[-across:]:
            axes.set_xlabel(name)
        axes = all_axes[0]
        axes.set_yticks(range(len(rows)), [f"{whole}: {name}" if whole else name for name, whole in rows.items()])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        for panel in all_axes:
            panel.tick_params(axis="y", which="both", length=0)
        if shares:
            handles = [Patch(label="first order: by itself", **FIRST), Patch(label="total: with all interactions", **TOTAL)]
            legend_below(figure, handles, "whiskers: one standard error")
    return figure


def _shown(result: Sensitivity, labels: Sequence[str]) -> list[Shown]:
    """The films of a result with panels: those with a known result, at the middle one of several voltages."""
    columns = {column.name: np.asarray(column.values) for column in result.films}
    known = result.total if isinstance(result, LifeShares) else result.elasticity
    groups: dict[tuple[float, ...], list[int]] = {}
    for film in np.flatnonzero(~np.all(np.isnan(known), axis=0)).tolist():
        groups.setdefault(tuple(float(values[film]) for name, values in columns.items() if name != "voltage"), []).append(film)
    middle = [films[len(films) // 2] for films in groups.values()]
    spread = result.spread if isinstance(result, LifeShares) else None
    return [Shown(result, film, _called(columns, film, labels, spread)) for film in middle]


def _called(
    columns: Mapping[str, NDArray[np.float64]], film: int, labels: Sequence[str], spread: NDArray[np.float64] | None
) -> str:
    """The title of a film: what distinguishes it, and the `spread` (films,) of its life in decades, if known."""
    far = [] if spread is None else [f"spread {number(float(spread[film]), 2)} decades"]
    if "case" in columns:
        case = int(columns["case"][film])
        return "\n".join([label for label in labels[case : case + 1] if label] + far)
    several = {name: bool(np.any(values != values[0])) for name, values in columns.items()}
    unit, factor = unit_for("V", float(columns["voltage"].max()))
    parts = [degrees(float(columns["temperature"][film]))] if several["temperature"] else []
    parts.append(prestretched(columns[f"prestretch_{axis}"][film] for axis in (1, 2)))
    if several.get("electrode_share"):
        parts.append(f"share {number(float(columns['electrode_share'][film]))}")
    return "\n".join([", ".join([*parts, f"{number(float(columns['voltage'][film]) * factor)} {unit}"]), *far])


def _rows(films: Sequence[Shown]) -> dict[str, str]:
    """The sources by name, the largest first and parts below their whole; and the whole of each part."""
    size: dict[str, float] = {}
    part_of: dict[str, str] = {}
    for shown in films:
        result = shown.result
        if isinstance(result, LifeShares):
            names, values = [source.name for source in result.sources], result.total
            part_of |= {source.name: source.part_of for source in result.sources}
        else:
            names, values = list(result.sources), np.abs(result.elasticity)
        for name, value in zip(names, values[:, shown.film].tolist(), strict=True):
            size[name] = max(size.get(name, 0.0), value)
    by_size = sorted(size, key=lambda name: -size[name])
    rows: dict[str, str] = {}
    for name in by_size:
        # a part is a row of its own if its whole is not drawn
        if part_of.get(name, "") not in size:
            rows[name] = ""
            rows |= dict.fromkeys((part for part in by_size if part_of.get(part) == name), name)
    return rows


def _bars(axes: Axes, shown: Shown, rows: Mapping[str, str]) -> None:
    """Draw the bars of a film."""
    result, film, place = shown.result, shown.film, {name: row for row, name in enumerate(rows)}
    whisker: Any = {"capsize": 1.8, "elinewidth": 0.8, "capthick": 0.8, "ecolor": "black"}
    if not isinstance(result, LifeShares):
        rows_of = [place[name] for name in result.sources]
        axes.barh(rows_of, result.elasticity[:, film], height=1.6 * BAR, **TOTAL)
        return
    at = np.array([place[source.name] for source in result.sources], dtype=float)
    for shift, values, errors, look in (
        (-BAR / 2, result.first_order, result.first_order_stderr, FIRST),
        (BAR / 2, result.total, result.total_stderr, TOTAL),
    ):
        axes.barh(at + shift, values[:, film], height=BAR, xerr=np.nan_to_num(errors[:, film]), error_kw=whisker, **look)
