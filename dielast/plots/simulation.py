"""The figure of simulated cases, with measured points laid over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dielast.plots.style import COLOURS, LINES, MARKERS, TEMPERATURES, log_axis, panels, style

Array = NDArray[np.float64]
# column -> axis label, and the factor that takes SI into the unit shown
LABELS = {
    "time [s]": ("time [s]", 1.0),
    "stretch_1 [1]": ("stretch", 1.0),
    "stretch_2 [1]": ("stretch in axis 2", 1.0),
    "nominal_stress_1 [Pa]": ("nominal stress [kPa]", 1e-3),
    "nominal_stress_2 [Pa]": ("nominal stress in axis 2 [kPa]", 1e-3),
    "true_stress_1 [Pa]": ("true stress [kPa]", 1e-3),
    "true_stress_2 [Pa]": ("true stress in axis 2 [kPa]", 1e-3),
    "relaxation_modulus [Pa]": ("relaxation modulus [kPa]", 1e-3),
    "voltage [V]": ("voltage [kV]", 1e-3),
    "relative_stretch_1 [1]": ("relative stretch", 1.0),
    "relative_stretch_2 [1]": ("relative stretch in axis 2", 1.0),
    "true_field [V/m]": ("true field [MV/m]", 1e-6),
    "stability [1]": ("stability det H / det H$_0$", 1.0),
    "major_axis [m]": ("major axis [mm]", 1e3),
    "minor_axis [m]": ("minor axis [mm]", 1e3),
}
MOST_IN_LEGEND = 7
# crosses and circles as in the paper's Fig. 13
EVENTS = {"breakdown": "x", "pull-in": "o", "loss-of-tension": "v"}


class Measured(Protocol):
    """Measured points of one `case` beside its curve: `x` and `y` (n,) in SI, and what the legend says."""

    @property
    def label(self) -> str: ...  # noqa: D102
    @property
    def case(self) -> int: ...  # noqa: D102
    @property
    def x(self) -> Array: ...  # noqa: D102
    @property
    def y(self) -> Array: ...  # noqa: D102


def plot_cases(
    cases: Sequence[Mapping[str, Array]],
    labels: Sequence[str],
    measured: Sequence[Measured],
    x: str,
    y: str,
    scales: tuple[str, str] = ("log", "linear"),
    title: str | None = None,
    marks: Sequence[tuple[int, str, float, float]] = (),
) -> Figure:
    """Column `y` over column `x` of every case, each a mapping of columns (times,) by header; `measured` points as markers.

    `marks` are events: the case, the name, and where, in the units of x and y.
    """
    with style():
        many = len(cases) > MOST_IN_LEGEND
        figure, (axes,) = panels(1, title, width=1.45 if many else 1.0)
        (x_label, x_factor), (y_label, y_factor) = (LABELS.get(header, (header, 1.0)) for header in (x, y))
        # what is nowhere positive has no place on a log axis
        there = [any(np.any(columns[header] > 0) for columns in cases) for header in (x, y)]
        scales = ("log" if scales[0] == "log" and there[0] else "linear", "log" if scales[1] == "log" and there[1] else "linear")
        named = set(np.linspace(0, len(cases) - 1, MOST_IN_LEGEND).astype(int).tolist())
        for index, (columns, label) in enumerate(zip(cases, labels, strict=True)):
            shown = np.ones(columns[x].size, dtype=bool)
            for header, scale in ((x, scales[0]), (y, scales[1])):
                shown &= (columns[header] > 0) | (scale != "log")
            colour = TEMPERATURES(index / (len(cases) - 1)) if many else COLOURS[index % len(COLOURS)]
            axes.plot(
                columns[x][shown] * x_factor,
                columns[y][shown] * y_factor,
                linestyle="-" if many else LINES[index % len(LINES)],
                color=colour,
                label=(label or "model") if index in named or not many else None,
            )
        for index, points in enumerate(measured):
            own = TEMPERATURES(points.case / (len(cases) - 1)) if many else COLOURS[points.case % len(COLOURS)]
            axes.plot(
                points.x * x_factor,
                points.y * y_factor,
                MARKERS[index % len(MARKERS)],
                color=own,
                markerfacecolor="white",
                markeredgewidth=0.8,
                label=points.label,
            )
        for name, symbol in EVENTS.items():
            here = [(case, across * x_factor, up * y_factor) for case, own, across, up in marks if own == name]
            for index, (case, across, up) in enumerate(here):
                own = TEMPERATURES(case / (len(cases) - 1)) if many else COLOURS[case % len(COLOURS)]
                axes.plot(
                    across,
                    up,
                    symbol,
                    color=own,
                    markersize=6,
                    markerfacecolor="none",
                    markeredgewidth=1.2,
                    zorder=4,
                    label=name if index == 0 else None,
                )
        _scale(axes, *scales)
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        if len(cases) > 1 or measured or marks:
            # beside the axes where so many curves leave no room within
            place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)} if many else {"loc": "best"}
            for text in axes.legend(**place).get_texts():
                text.set_parse_math(False)
    return figure


def _scale(axes: Axes, x: str, y: str) -> None:
    for which, scale in (("x", x), ("y", y)):
        if scale == "log":
            log_axis(axes, which)
