"""The figure of a failure map: time to failure over voltage with the exponential law, and the map over voltage and prestretch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from dielast.plots.style import COLOURS, LINES, MARKERS, TEMPERATURES, log_axis, panels, style
from dielast.simulate.failure_map import FailureMap
from dielast.simulate.lifetime import LifetimeLine

MOST_LINES = 5
FEWEST_FOR_A_MAP = 5  # prestretches
# what contour lines show: round times
CONTOURS = {1.0: "1 s", 60.0: "1 min", 600.0: "10 min", 3600.0: "1 h", 21600.0: "6 h", 86400.0: "24 h"}


def plot_failure_map(result: FailureMap, lines: Sequence[LifetimeLine], title: str | None = None) -> Figure:
    """Time to failure over voltage for some films; for many prestretches of the first temperature also the map."""
    equibiaxial = bool(np.all(result.prestretch[:, 0] == result.prestretch[:, 1]))
    mapped = len(result.prestretch) >= FEWEST_FOR_A_MAP and result.voltage.size >= FEWEST_FOR_A_MAP and equibiaxial
    with style():
        figure, axes = panels(2 if mapped else 1, title, widths=(1.0, 1.2) if mapped else None)
        _lifetimes(axes[0], result, lines)
        if mapped:
            _map(figure, axes[1], result)
            for label, own in zip("ab", axes, strict=True):
                own.set_title(f"({label})", loc="left")
    return figure


def _lifetimes(axes: Axes, result: FailureMap, lines: Sequence[LifetimeLine]) -> None:
    films = [(i, j) for i in range(result.temperature.size) for j in range(len(result.prestretch))]
    chosen = np.unique(np.linspace(0, len(films) - 1, MOST_LINES).astype(int))
    for index, film in enumerate(chosen):
        i, j = films[film]
        time, line = result.time_to_failure[i, j], lines[film]
        fails = np.isfinite(time) & (time > 0)
        if not fails.any():
            continue
        colour = COLOURS[index % len(COLOURS)]
        pair = result.prestretch[j]
        label = f"prestretch {pair[0]:g}" if pair[0] == pair[1] else f"prestretch {pair[0]:g} x {pair[1]:g}"
        if result.temperature.size > 1:
            label += f", {result.temperature[i]:g} °C"
        axes.plot(
            result.voltage[fails] / 1e3,
            time[fails],
            MARKERS[index % len(MARKERS)],
            color=colour,
            markerfacecolor="white",
            label=label,
        )
        if np.isfinite(line.slope):
            span = result.voltage[fails][[0, -1]]
            axes.plot(span / 1e3, 10 ** (line.intercept + line.slope * span), linestyle=LINES[index % len(LINES)], color=colour)
    axes.set_xlabel("voltage [kV]")
    axes.set_ylabel("time to failure [s]")
    log_axis(axes, "y")
    if axes.lines:
        axes.legend(loc="upper right", title="lines: exponential law", title_fontsize=7, fontsize=6.5)


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
        axes.pcolor(voltage, prestretch, cells, shading="nearest", hatch="////", alpha=0.0, linewidth=0.0)
        handles.append(Patch(facecolor="none", edgecolor="black", hatch="////", linewidth=0.5, label="pull-in first"))
    if (mode == "breakdown").any() and (mode == "pull-in").any():
        handles.append(Patch(facecolor=TEMPERATURES(0.5), edgecolor="black", linewidth=0.5, label="breakdown first"))
    if handles:
        axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=len(handles))
    if result.temperature.size > 1:
        axes.set_title(f"{result.temperature[0]:g} °C", loc="right")
    axes.set_xlabel("voltage [kV]")
    axes.set_ylabel("prestretch")
