"""The figure of a failure map: time to failure over voltage with the exponential law, and the map over voltage and prestretch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from dielast.plots.lifetimes import MOST_LINES, Panel, arrange, draw_panels, films_of, legend, notes, spread_indices
from dielast.plots.style import TEMPERATURES, panels, sheet, style
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import LifetimeLine

Array = NDArray[np.float64]
MOST_BESIDE_A_MAP = 4  # prestretches; the map shows them all
FEWEST_FOR_A_MAP = 5  # prestretches
# what contour lines show: round times
CONTOURS = {1.0: "1 s", 60.0: "1 min", 600.0: "10 min", 3600.0: "1 h", 21600.0: "6 h", 86400.0: "24 h"}


def plot_failure_map(
    result: FailureMap,
    lines: Sequence[LifetimeLine],
    title: str | None = None,
    bounds: tuple[Array, Array] | None = None,
    interval: str = "interval",
) -> Figure:
    """Time to failure over voltage; for many equibiaxial prestretches some of the films, and the map of the first temperature.

    `bounds`, lower and upper of the time to failure and of its shape, are drawn as bands, which the legend calls
    `interval`; infinite is beyond the horizon, where a band is open, as it is where it reaches down to zero.
    """
    equibiaxial = bool(np.all(result.prestretch[:, 0] == result.prestretch[:, 1]))
    mapped = len(result.prestretch) >= FEWEST_FOR_A_MAP and result.voltage.size >= FEWEST_FOR_A_MAP and equibiaxial
    arranged = [Panel(_beside_a_map(result))] if mapped else arrange(result)
    films = [films_of(panel, result, lines, bounds) for panel in arranged]
    said = notes(films, None if bounds is None else interval, _left_out(result, sum(map(len, films)), mapped))
    rows, count = max(-(-len(own) // 2) for own in films), len(arranged)
    with style():
        if mapped:
            figure, axes = panels(2, title, widths=(1.0, 1.2), height=2.75 + 0.15 * rows)
        else:
            across = min(count, 2)
            down = -(-count // across)
            figure = sheet(title, across, down * (2.75 + 0.15 * rows))
            axes = list(figure.subplots(down, across, squeeze=False).ravel())
            for unused in axes[count:]:
                unused.remove()
        draw_panels(axes[:count], result, films)
        for own, panel, drawn in zip(axes, arranged, films, strict=False):
            own.set_ylabel("time to failure [s]")
            own.set_title(panel.title, loc="right")
            legend(own, drawn, said if count == 1 else None)
        if count > 1 and said is not None:
            figure.supxlabel(said, fontsize=7)
        if mapped:
            _map(figure, axes[1], result)
        if mapped or count > 1:
            for label, own in zip("abcdef", axes, strict=False):
                own.set_title(f"({label})", loc="left")
    return figure


def _left_out(result: FailureMap, drawn: int, mapped: bool) -> str | None:
    """How many films have no line, and why."""
    films = result.failure_mode[..., 0].size
    if drawn == films:
        return None
    if not mapped:
        return f"{drawn} of {films} films: more would not be legible"
    at = f" at {result.temperature[0]:g} °C" if result.temperature.size > 1 else ""
    return f"{drawn} of {films} films; (b) shows all{at}"


def _beside_a_map(result: FailureMap) -> list[tuple[int, int]]:
    """Temperature and prestretch of the films whose lines stand beside the map: some prestretches, or one over temperature."""
    temperatures, prestretches = result.failure_mode.shape[:2]
    if temperatures == 1:
        return [(0, j) for j in spread_indices(prestretches, MOST_BESIDE_A_MAP)]
    return [(i, prestretches // 2) for i in spread_indices(temperatures, MOST_LINES)]


def _map(figure: Figure, axes: Axes, result: FailureMap) -> None:
    """The first temperature's map: colour and contour lines for the time, hatching for how the film fails."""
    voltage, prestretch = result.voltage / 1e3, result.prestretch[:, 0]
    order = np.argsort(prestretch)
    time, mode = result.time_to_failure[0][order], result.failure_mode[0][order]
    prestretch = prestretch[order]
    shown = np.where(time > 0, time, np.nan)
    finite = shown[np.isfinite(shown)]
    axes.set_facecolor("0.92")
    if finite.size:
        shortest, longest = float(finite.min()), float(finite.max())
        scale = LogNorm(shortest, longest if longest > shortest else 10 * shortest)
        cells = np.ma.masked_invalid(shown)
        axes.pcolormesh(voltage, prestretch, cells, norm=scale, cmap=TEMPERATURES, shading="nearest", rasterized=True)
        figure.colorbar(ScalarMappable(scale, TEMPERATURES), ax=axes, label="time to failure [s]", pad=0.02, aspect=30)
        levels = [level for level in CONTOURS if shortest < level < longest]
        if levels and min(shown.shape) > 1:
            contours = axes.contour(voltage, prestretch, cells, levels=levels, colors="white", linewidths=0.9)
            axes.clabel(contours, fmt=CONTOURS, fontsize=6.5)
    regions = [
        ("survives", mode == "none", "0.92"),
        ("at once", time == 0, "0.6"),
        ("not finished", mode == "unfinished", "#E6A0A0"),
    ]
    handles = []
    for name, where, colour in regions:
        if where.any():
            # on the cells themselves, as the times are
            cells = np.ma.masked_where(~where, np.ones(where.shape))
            axes.pcolormesh(voltage, prestretch, cells, cmap=ListedColormap([colour]), shading="nearest", rasterized=True)
            handles.append(Patch(facecolor=colour, edgecolor="black", linewidth=0.5, label=name))
    pulled = mode == "pull-in"
    if pulled.any():
        cells = np.ma.masked_where(~pulled, np.ones(pulled.shape))
        clear = ListedColormap([(0.0, 0.0, 0.0, 0.0)])
        axes.pcolor(voltage, prestretch, cells, cmap=clear, shading="nearest", hatch="////", edgecolor="white", linewidth=0.0)
        handles.append(Patch(facecolor=TEMPERATURES(0.2), edgecolor="white", hatch="////", linewidth=0.5, label="pull-in first"))
    if (mode == "breakdown").any() and (mode == "pull-in").any():
        handles.append(Patch(facecolor=TEMPERATURES(0.5), edgecolor="black", linewidth=0.5, label="breakdown first"))
    if handles:
        axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=len(handles))
    if result.temperature.size > 1:
        axes.set_title(f"{result.temperature[0]:g} °C", loc="right")
    axes.set_xlabel("voltage [kV]")
    axes.set_ylabel("prestretch")
