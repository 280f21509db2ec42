"""The figure of a failure map: time to failure over voltage with its law, and the map over voltage and prestretch."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.typing import ColorType
from numpy.typing import NDArray

from dielast.mechanics.criteria import named
from dielast.plots.lifetimes import MOST_LINES, arrange, draw_panels, films_of, legend, notes
from dielast.plots.looks import MOST_BANDS, Panel
from dielast.plots.style import TEMPERATURES, grid, letter, panels, row_legend, sheet, spread_indices, style
from dielast.plots.texts import SECONDS, degrees, lasting, log_axis, number, power_of_ten, unit_for
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import LifetimeLine

MOST_BESIDE_A_MAP = 4  # prestretches with lines; the map shows all
FEWEST_FOR_A_MAP = 5  # prestretches
UNFINISHED = "#E6A0A0"
AT_ONCE = "0.6"
CLEAR = ListedColormap([(0.0, 0.0, 0.0, 0.0)])


def patch(colour: ColorType, label: str) -> Patch:
    """The patch of a filled region in a legend."""
    return Patch(facecolor=colour, edgecolor="black", linewidth=0.5, label=label)


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """The cells of the map of one temperature: `voltage` (nv,) in `unit`, and `prestretch` (np,), ascending, which are those of the
    result in this `order` (np,).
    """

    unit: str
    voltage: NDArray[np.float64]
    prestretch: NDArray[np.float64]
    order: NDArray[np.intp]

    @classmethod
    def of(cls, result: FailureMap) -> Cells:
        """The cells of a map of equibiaxial prestretches."""
        unit, factor = unit_for("V", float(result.voltage.max()))
        order = np.argsort(result.prestretch[:, 0])
        return cls(unit, result.voltage * factor, result.prestretch[order, 0], order)

    def fill(self, axes: Axes, where: NDArray[np.bool_], colour: str, label: str) -> Patch:
        """Fill the cells `where` (np, nv) is True."""
        cells = np.ma.masked_where(~where, np.ones(where.shape))
        axes.pcolormesh(self.voltage, self.prestretch, cells, cmap=ListedColormap([colour]), shading="nearest", rasterized=True)
        return patch(colour, label)

    def hatch(self, axes: Axes, mode: NDArray[np.str_], failures: Iterable[str], colour: ColorType) -> list[Patch]:
        """Hatch the cells whose `mode` (np, nv) is one of the `failures` with a hatch; the patches have it on a `colour`."""
        patches = []
        for failure in failures:
            hatch, where = named(failure).hatch, mode == failure
            if hatch and where.any():
                cells = np.ma.masked_where(~where, np.ones(mode.shape))
                places = self.voltage, self.prestretch
                axes.pcolor(*places, cells, cmap=CLEAR, shading="nearest", hatch=hatch, edgecolor="white", linewidth=0.0)
                patches.append(Patch(facecolor=colour, edgecolor="white", hatch=hatch, linewidth=0.5, label=f"{failure} first"))
        return patches


def is_map(result: FailureMap) -> bool:
    """Whether the films are a grid of voltages and prestretches."""
    equibiaxial = bool(np.all(result.prestretch[:, 0] == result.prestretch[:, 1]))
    one_share = result.electrode_share is None or bool(np.all(result.electrode_share == result.electrode_share[0]))
    return equibiaxial and one_share and min(len(result.prestretch), result.voltage.size) >= FEWEST_FOR_A_MAP


def plot_failure_map(
    result: FailureMap,
    lines: Sequence[LifetimeLine],
    title: str | None = None,
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None,
    interval: str = "interval",
) -> Figure:
    """Time to failure over voltage; for many equibiaxial prestretches some of the films, and the map of the first temperature.

    Default `title`: the temperatures and prestretches.

    `bounds` are lower and upper bounds of the time to failure, of its shape; they are drawn as bands, named `interval` in the
    legend. An infinite bound is beyond the horizon: the band is open there, as it is at a bound of zero.
    """
    title = title or _head(result)
    mapped = is_map(result)
    most = MOST_LINES if bounds is None else MOST_BANDS
    arranged = [Panel(_beside_a_map(result, most))] if mapped else arrange(result, most)
    films = [films_of(panel, result, lines, bounds) for panel in arranged]
    note = notes(films, None if bounds is None else interval, _left_out(result, sum(map(len, films)), mapped))
    rows, count = max(-(-len(panel) // 2) for panel in films), len(arranged)
    with style():
        if mapped:
            figure, axes = panels(2, title, widths=(1.0, 1.2), height=2.75 + 0.15 * rows)
        else:
            across = min(count, 2)
            figure = sheet(title, across, -(-count // across) * (2.75 + 0.15 * rows))
            axes = grid(figure, count, across)
        draw_panels(axes[:count], result, films)
        for place, panel, drawn in zip(axes, arranged, films, strict=False):
            place.set_ylabel("time to failure [s]")
            place.set_title(panel.title, loc="right")
            legend(place, drawn, note if count == 1 else None)
        if count > 1 and note is not None:
            figure.supxlabel(note, fontsize=7)
        if mapped:
            _map(figure, axes[1], result)
        if mapped or count > 1:
            letter(axes)
    return figure


def _head(result: FailureMap) -> str:
    """Temperatures and prestretches of a map, for the title of its figure."""
    low, high = degrees(float(result.temperature.min())), degrees(float(result.temperature.max()))
    least, most = number(float(result.prestretch.min())), number(float(result.prestretch.max()))
    return f"{low if low == high else f'{low} to {high}'}, prestretch {least if least == most else f'{least} to {most}'}"


def _left_out(result: FailureMap, drawn: int, mapped: bool) -> str | None:
    """A note on the number of films without a line."""
    films = result.failure_mode[..., 0].size
    if drawn == films:
        return None
    if not mapped:
        return f"{drawn} of {films} films: more would not be legible"
    at = f" at {degrees(result.temperature[0])}" if result.temperature.size > 1 else ""
    return f"{drawn} of {films} films; (b) shows all{at}"


def _beside_a_map(result: FailureMap, most: int) -> list[tuple[int, int]]:
    """The films with lines beside the map: some prestretches at one temperature, or one prestretch at all temperatures."""
    temperatures, prestretches = result.failure_mode.shape[:2]
    if temperatures == 1:
        return [(0, j) for j in spread_indices(prestretches, min(most, MOST_BESIDE_A_MAP))]
    return [(i, prestretches // 2) for i in spread_indices(temperatures, most)]


def _map(figure: Figure, axes: Axes, result: FailureMap) -> None:
    """The map of the first temperature: colours and contour lines for the time, hatching for the mode of failure."""
    cells = Cells.of(result)
    time, mode = result.time_to_failure[0, cells.order], result.failure_mode[0, cells.order]
    shown = np.where(time > 0, time, np.nan)
    finite = shown[np.isfinite(shown)]
    axes.set_facecolor("0.92")
    if finite.size:
        shortest, longest = float(finite.min()), float(finite.max())
        scale = LogNorm(shortest, longest if longest > shortest else 10 * shortest)
        lives, places = np.ma.masked_invalid(shown), (cells.voltage, cells.prestretch)
        axes.pcolormesh(*places, lives, norm=scale, cmap=TEMPERATURES, shading="nearest", rasterized=True)
        bar = figure.colorbar(ScalarMappable(scale, TEMPERATURES), ax=axes, label="time to failure [s]", pad=0.02, aspect=30)
        log_axis(bar.ax, "y")
        _contours(axes, *places, np.ma.log10(lives))
    regions = [
        ("survives", mode == "none", "0.92"),
        ("fails at once", time == 0, AT_ONCE),
        ("not finished", mode == "unfinished", UNFINISHED),
    ]
    handles = [cells.fill(axes, where, colour, name) for name, where, colour in regions if where.any()]
    handles += cells.hatch(axes, mode, result.times, TEMPERATURES(0.2))
    happens = [name for name in result.times if (mode == name).any()]
    if len(happens) > 1:
        handles += [patch(TEMPERATURES(0.5), f"{name} first") for name in happens if not named(name).hatch]
    if handles:
        columns = min(len(handles), 3)  # a legend wider than the figure would spoil its layout
        row_legend(axes, handles, columns, loc="upper center", bbox_to_anchor=(0.5, -0.2))
    if result.temperature.size > 1:
        axes.set_title(degrees(result.temperature[0]), loc="right")
    axes.set(xlabel=f"voltage [{cells.unit}]", ylabel="prestretch")


def _contours(axes: Axes, voltage: NDArray[np.float64], prestretch: NDArray[np.float64], decades: Any) -> None:
    """A contour line, with its label, for each decade of the time to failure in s between the shortest and the longest."""
    levels = np.arange(np.ceil(decades.min()), np.floor(decades.max()) + 1)
    if not levels.size or min(decades.shape) < 2:
        return
    contours = axes.contour(voltage, prestretch, decades, levels=levels, colors="white", linewidths=0.9, linestyles="solid")
    names = {float(level): decade_name(int(level)) for level in levels}
    named = {text.get_text() for text in axes.clabel(contours, fmt=names, fontsize=6.5)}
    for level, path in zip(levels.tolist(), contours.get_paths(), strict=True):
        # a line that is too short for a label on it has its label beside it
        along = np.asarray(path.vertices)
        if names[level] not in named and len(along):
            middle: tuple[float, float] = tuple(along[len(along) // 2])
            # and within the axes
            side, aside = ("left", 2) if middle[0] < np.mean(axes.get_xlim()) else ("right", -2)
            look: Any = {"fontsize": 6.5, "color": "white", "va": "center", "ha": side}
            axes.annotate(names[level], middle, (aside, 0), textcoords="offset points", **look)


def decade_name(exponent: int) -> str:
    """The label of a line at 10 to this power seconds."""
    seconds = 10.0**exponent
    if exponent < 3:
        # 0.1 of a unit reads better than 100 of the next smaller unit
        unit, name = next(((unit, name) for unit, name in SECONDS if seconds >= 0.09 * unit), SECONDS[-1])
        return f"{number(seconds / unit)} {name}"
    power = "1000" if exponent == 3 else power_of_ten(exponent)
    return f"{power} s ({lasting(seconds, 2)})"
