"""The figure of a failure map: time to failure over voltage with the exponential law, and the map over voltage and prestretch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from dielast.plots.style import COLOURS, LINES, MARKERS, TEMPERATURES, log_axis, panels, style
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import LifetimeLine

Array = NDArray[np.float64]
MOST_LINES = 6
MOST_BESIDE_A_MAP = 4  # prestretches; the map shows them all
MOST_MARKERS = 13  # a line
MOST_ARROWS = 3  # a band
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
    """Time to failure over voltage for some films; for many prestretches of the first temperature also the map.

    `bounds`, lower and upper of the time to failure and of its shape, are drawn as bands, which the legend calls
    `interval`; infinite is beyond the horizon, where a band is open.
    """
    equibiaxial = bool(np.all(result.prestretch[:, 0] == result.prestretch[:, 1]))
    mapped = len(result.prestretch) >= FEWEST_FOR_A_MAP and result.voltage.size >= FEWEST_FOR_A_MAP and equibiaxial
    with style():
        chosen = _chosen(result, mapped)
        rows = -(-len(chosen) // 2)
        figure, axes = panels(2 if mapped else 1, title, widths=(1.0, 1.2) if mapped else None, height=2.75 + 0.15 * rows)
        _lifetimes(axes[0], result, chosen, lines, bounds, interval)
        if mapped:
            _map(figure, axes[1], result)
            for label, own in zip("ab", axes, strict=True):
                own.set_title(f"({label})", loc="left")
    return figure


def _chosen(result: FailureMap, mapped: bool) -> list[tuple[int, int]]:
    """Temperature and prestretch of the films to draw: all if they are few, else some prestretches, or one over temperature."""
    temperatures, prestretches = result.failure_mode.shape[:2]
    if temperatures * prestretches <= MOST_LINES and not mapped:
        return [(i, j) for i in range(temperatures) for j in range(prestretches)]
    if temperatures == 1:
        return [(0, j) for j in _spread(prestretches, MOST_BESIDE_A_MAP if mapped else MOST_LINES)]
    return [(i, prestretches // 2) for i in _spread(temperatures, MOST_LINES)]


def _spread(count: int, most: int) -> list[int]:
    """At most so many indices of `count`, evenly spread from the first to the last."""
    return [int(index) for index in np.unique(np.linspace(0, count - 1, min(count, most)).round())]


def _lifetimes(
    axes: Axes,
    result: FailureMap,
    chosen: Sequence[tuple[int, int]],
    lines: Sequence[LifetimeLine],
    bounds: tuple[Array, Array] | None,
    interval: str,
) -> None:
    handles: list[Line2D] = []
    fitted, top = False, 2 * result.horizon
    opened = bounds is not None and any(np.any(np.isfinite(bounds[0][film]) & np.isinf(bounds[1][film])) for film in chosen)
    for index, (i, j) in enumerate(chosen):
        time, line = result.time_to_failure[i, j], lines[i * len(result.prestretch) + j]
        fails = np.isfinite(time) & (time > 0)
        colour = COLOURS[index % len(COLOURS)]
        if bounds is not None:
            low, high = bounds[0][i, j], np.minimum(bounds[1][i, j], top)
            within = np.isfinite(low) & (low > 0)
            look: Any = {"color": colour, "alpha": 0.18, "linewidth": 0.0}
            axes.fill_between(result.voltage / 1e3, low, high, where=within, **look)
            _arrows(axes, result.voltage[within & (high == top)] / 1e3, 1.4 * result.horizon, index, colour)
        if not fails.any():
            continue
        pair = result.prestretch[j]
        label = f"prestretch {pair[0]:g}" if pair[0] == pair[1] else f"prestretch {pair[0]:g} x {pair[1]:g}"
        if result.temperature.size > 1:
            label += f", {result.temperature[i]:g} °C"
        marker: Any = {"marker": MARKERS[index % len(MARKERS)], "color": colour, "markerfacecolor": "white"}
        dashes: Any = LINES[index % len(LINES)] if np.isfinite(line.slope) else "none"
        every = _spread(int(np.count_nonzero(fails)), MOST_MARKERS)
        axes.plot(result.voltage[fails] / 1e3, time[fails], linestyle="none", zorder=3, markevery=every, **marker)
        handles.append(Line2D([], [], linestyle=dashes, linewidth=0.9, label=label, **marker))
        if np.isfinite(line.slope):
            fitted = True
            span = result.voltage[fails][[0, -1]]
            axes.plot(span / 1e3, 10 ** (line.intercept + line.slope * span), linestyle=dashes, linewidth=0.9, color=colour)
    axes.set_xlabel("voltage [kV]")
    axes.set_ylabel("time to failure [s]")
    axes.set_yscale("log")
    if opened:
        axes.axhline(result.horizon, color="0.5", linestyle=":", linewidth=0.8)
        axes.set_ylim(top=top)
    log_axis(axes, "y")
    if handles:
        # below the axes: within, the points of long and of short lives leave no corner free
        notes = ["lines: exponential law"] * fitted + [f"bands: {interval}"] * (bounds is not None)
        said = "; ".join(notes) + "\narrows: open above, some survive the horizon (dotted)" * opened or None
        place: Any = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.2), "ncols": min(2, len(handles))}
        axes.legend(handles=handles, title=said, title_fontsize=7, fontsize=6.5, handlelength=3.0, **place)


def _arrows(axes: Axes, along: Array, up: float, film: int, colour: Any) -> None:
    """Arrows where a band is open above, those of every film in a place of their own."""
    place: Any = {"textcoords": "offset points", "ha": "center", "va": "center", "annotation_clip": False}
    for index in _spread(along.size, MOST_ARROWS):
        axes.annotate("\N{UPWARDS ARROW}", (float(along[index]), up), (5.0 * film, 0.0), color=colour, fontsize=8, **place)


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
