"""The figure of many cycles: amplitude, phase and work over the number of the cycle."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from dielast.io.table import split_header
from dielast.numerics.arrays import Floats
from dielast.plots.looks import Swept, arrange
from dielast.plots.quantities import axis_of
from dielast.plots.style import legend_below, letter, panels, style
from dielast.plots.ticks import log_axis

SHOWN = "amplitude", "phase", "work"


def plot_cycles(
    cases: Sequence[Mapping[str, Floats]], labels: Sequence[str], swept: Sequence[Swept], measured: str, title: str | None = None
) -> Figure:
    """Amplitude of the `measured` quantity, phase, and work of each cycle; each case maps headers to columns (cycles,)."""
    with style():
        arranged = arrange(labels, swept)
        shown = arranged.shown if len(arranged.panels) == 1 else list(range(len(cases)))
        figure, axes = panels(len(SHOWN), title)
        for place, name in zip(axes, SHOWN, strict=True):
            header = next(header for header in cases[0] if split_header(header)[0] == name)
            label, factor = axis_of(header, [cases[case][header] for case in shown])
            for case in shown:
                place.plot(cases[case]["cycle"], factor * cases[case][header], linewidth=arranged.width, **arranged.looks[case])
            place.set_xlabel("cycle")
            place.set_ylabel(
                f"amplitude of the {axis_of(measured)[0].partition(' [')[0]}{_unit(label)}" if name == SHOWN[0] else label
            )
            if max(float(np.max(cases[case]["cycle"], initial=1.0)) for case in shown) > 10:
                place.set_xscale("log")
                log_axis(place, "x")
        letter(axes)
        named = {case: name for case, name in arranged.named.items() if name}
        handles = [Line2D([], [], label=name, linewidth=arranged.width, **arranged.looks[case]) for case, name in named.items()]
        if handles and len(cases) > 1:
            legend_below(figure, handles, None)
    return figure


def _unit(label: str) -> str:
    """The unit of a label, in brackets."""
    _, bracket, rest = label.partition(" [")
    return bracket + rest
