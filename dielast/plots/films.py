"""Further figures of films: the states that a film can be in, with the cycle of a generator; and profiles across a film."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dielast.plots.style import entry, legend_below, line_look, panels, spread_indices, style
from dielast.plots.texts import lasting, unit_for
from dielast.simulate.limits import Limits

ROOM = 1.25  # highest voltage that is shown, over that of the cycles
LOOKS = {"breakdown": "-", "pull_in": "--", "loss_of_tension": ":"}
NAMES = {"pull_in": "pull-in", "loss_of_tension": "loss of tension"}
MOST_TIMES = 6
INSIDE = 2  # rows of the table for the active part
FAR = 8.0  # radii of the electrode that are shown: the film beyond hardly moves


def plot_limits(limits: Limits, cycles: Sequence[Mapping[str, NDArray[np.float64]]], title: str | None = None) -> Figure:
    """The limits over the stretch of axis 1, each a line, what lies beyond one of them grey, and the course of each case of
    `cycles`, by the headers of its columns.
    """
    highest = ROOM * max((float(np.nanmax(np.abs(case["voltage [V]"]), initial=0.0)) for case in cycles), default=0.0)
    least = np.minimum.reduce([getattr(limits, name) for name in LOOKS])
    if not highest:
        highest = float(np.max(least[np.isfinite(least)], initial=1.0))
    unit, factor = unit_for("V", highest)
    with style():
        figure, (axes,) = panels(1, title)
        handles = []
        axes.fill_between(limits.stretch, factor * np.minimum(least, highest), factor * highest, color="0.93", linewidth=0)
        for name, dashes in LOOKS.items():
            look: Any = {"color": "0.45", "linestyle": dashes, "linewidth": 1.0}
            voltage = getattr(limits, name)
            shown = factor * np.where(np.isfinite(voltage), voltage, np.nan)
            handles += axes.plot(limits.stretch, shown, label=NAMES.get(name, name), **look)
        if limits.rupture_stretch is not None:
            axes.axvspan(limits.rupture_stretch, max(limits.rupture_stretch, limits.stretch[-1]), color="0.93", linewidth=0)
            handles.append(axes.axvline(limits.rupture_stretch, color="0.45", linestyle="-.", linewidth=1.0, label="rupture"))
        for case in cycles:
            axes.plot(case["stretch_1 [1]"], factor * np.abs(case["voltage [V]"]), color="k", linewidth=1.3)
        if cycles:
            handles.append(entry(color="k", linewidth=1.3, label="cycle" if len(cycles) == 1 else "cycles"))
        axes.set_xlim(limits.stretch[0], limits.stretch[-1])
        axes.set_ylim(0, factor * highest)
        axes.set(xlabel="stretch", ylabel=f"voltage [{unit}]")
        legend_below(figure, handles)
    return figure


def plot_profile(cases: Sequence[Mapping[str, NDArray[np.float64]]], title: str | None, place: str) -> Figure:
    """Stretches and nominal stresses of the first case over the radius, or another `place`, with a line for each time.

    Thick lines are components along the radius or the length, thin lines components across. The electrode is shaded.
    """
    table = next((case for case in cases if case["time [s]"].size), cases[0])
    times = list(dict.fromkeys(table["time [s]"].tolist()))
    chosen = [times[index] for index in spread_indices(len(times), MOST_TIMES)] if times else []
    with style():
        figure, axes = panels(2, title)
        stress = np.concatenate([table[f"nominal_stress_{axis} [Pa]"] for axis in (1, 2)])
        unit, factor = unit_for("Pa", float(np.nanmax(np.abs(stress), initial=1.0)))
        handles = []
        for number, time in enumerate(chosen):
            rows = table["time [s]"] == time
            radius, line = table["radius [1]"][rows], line_look(number)
            for panel, (name, scale) in zip(axes, (("stretch_{} [1]", 1.0), ("nominal_stress_{} [Pa]", factor)), strict=True):
                for axis, width in ((1, 1.3), (2, 0.6)):
                    values = scale * table[name.format(axis)][rows]
                    for part in (slice(0, INSIDE), slice(INSIDE, None)):
                        panel.plot(radius[part], values[part], linewidth=width, **line)
            handles.append(entry(label=lasting(time) if time else "0 s", **line))
        for panel, label in zip(axes, ("stretch", f"nominal stress [{unit}]"), strict=True):
            widest = float(np.max(table["radius [1]"], initial=1.0))
            panel.set_xlim(0, min(widest, FAR))
            panel.axvspan(0, 1, color="0.93", linewidth=0)
            panel.set(xlabel=place, ylabel=label)
        along, across = ("radial", "hoop") if place.startswith("radius") else ("along", "across")
        handles += [entry(color="0.4", linewidth=width, label=text) for width, text in ((1.3, along), (0.6, across))]
        legend_below(figure, handles)
    return figure
