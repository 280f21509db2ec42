"""The figure of stretches and stresses across a film with a passive part."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from dielast.plots.quantities import unit_for
from dielast.plots.style import legend_below, line_look, panels, spread_indices, style
from dielast.plots.texts import lasting

MOST_TIMES = 6
INSIDE = 2  # rows of the table for the active part
FAR = 8.0  # radii of the electrode that are shown: the film beyond hardly moves


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
            handles.append(Line2D([], [], label=lasting(time) if time else "0 s", **line))
        for panel, label in zip(axes, ("stretch", f"nominal stress [{unit}]"), strict=True):
            widest = float(np.max(table["radius [1]"], initial=1.0))
            panel.set_xlim(0, min(widest, FAR))
            panel.axvspan(0, 1, color="0.93", linewidth=0)
            panel.set_xlabel(place)
            panel.set_ylabel(label)
        along, across = ("radial", "hoop") if place.startswith("radius") else ("along", "across")
        handles += [Line2D([], [], color="0.4", linewidth=width, label=text) for width, text in ((1.3, along), (0.6, across))]
        legend_below(figure, handles)
    return figure
