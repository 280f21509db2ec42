"""The figure of the states that a film can be in, with the cycle of a generator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dielast.numerics.arrays import Floats
from dielast.plots.quantities import unit_for
from dielast.plots.style import legend_below, panels, style
from dielast.simulate.limits import Limits

ROOM = 1.25  # highest voltage that is shown, over that of the cycles
LOOKS = {"breakdown": "-", "pull_in": "--", "loss_of_tension": ":"}
NAMES = {"pull_in": "pull-in", "loss_of_tension": "loss of tension"}


def plot_limits(limits: Limits, cycles: Sequence[Mapping[str, Floats]], title: str | None = None) -> Figure:
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
            axes.plot(limits.stretch, factor * np.where(np.isfinite(voltage), voltage, np.nan), **look)
            handles.append(Line2D([], [], label=NAMES.get(name, name), **look))
        if limits.rupture_stretch is not None:
            axes.axvspan(limits.rupture_stretch, max(limits.rupture_stretch, limits.stretch[-1]), color="0.93", linewidth=0)
            axes.axvline(limits.rupture_stretch, color="0.45", linestyle="-.", linewidth=1.0)
            handles.append(Line2D([], [], color="0.45", linestyle="-.", linewidth=1.0, label="rupture"))
        for case in cycles:
            axes.plot(case["stretch_1 [1]"], factor * np.abs(case["voltage [V]"]), color="k", linewidth=1.3)
        if cycles:
            handles.append(Line2D([], [], color="k", linewidth=1.3, label="cycle" if len(cycles) == 1 else "cycles"))
        axes.set_xlim(limits.stretch[0], limits.stretch[-1])
        axes.set_ylim(0, factor * highest)
        axes.set_xlabel("stretch")
        axes.set_ylabel(f"voltage [{unit}]")
        legend_below(figure, handles)
    return figure
