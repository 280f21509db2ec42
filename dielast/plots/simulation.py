"""The figure of simulated cases, with measured points laid over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
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
MOST_IN_LEGEND = 7  # cases, each in a colour of its own
MOST_NAMED = 6  # of more cases that no scale can tell apart
MOST_WITHIN = 4  # entries of a legend for which there is room between the curves
MOST_TICKS = 8
SHADE = 0.18  # opacity of a band
BAR = 0.8  # line width of the bar through an event
LONGEST_LABEL = 58  # characters at column width
# crosses and circles as in the paper's Fig. 13
EVENTS = {"breakdown": "x", "pull-in": "o", "loss-of-tension": "v"}


@dataclass(frozen=True, slots=True)
class Swept:
    """A swept quantity: how an axis calls it, and its value in each case."""

    label: str
    values: tuple[float, ...]

    @property
    def steps(self) -> list[float]:
        """Its different values, ascending."""
        return sorted(set(self.values))


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
    swept: Sequence[Swept] = (),
    bands: Sequence[tuple[Array, Array, Array] | None] = (),
    interval: str = "interval",
    spans: Sequence[tuple[float, float] | None] = (),
) -> Figure:
    """Column `y` over column `x` of every case, each a mapping of columns (times,) by header; `measured` points as markers.

    `marks` are events: the case, the name, and where, in the units of x and y. Many cases are told apart by a scale of colours if
    one number is `swept`, and by line styles too if a second one is; else the legend names some of them. `bands` are x, lower and
    upper y of what each case may be, None for a case known exactly; the legend calls them `interval`. `spans` are lower and upper x
    of what each mark may be, infinite where it may never come.
    """
    with style():
        looks = _looks(len(cases), swept)
        spread = any(span is not None for span in spans)
        handles = _handles(labels, looks, measured, marks, spread)
        banded = any(one is not None for one in bands)
        if banded:
            shade: Any = {"facecolor": looks.each[0]["color"] if len(cases) == 1 else "black", "alpha": SHADE, "linewidth": 0.0}
            handles.append(Patch(label=interval, **shade))
        rows, columns = _shape(handles) if len(handles) > MOST_WITHIN else (0, 1)
        figure, (axes,) = panels(1, title, height=2.7 + 0.15 * rows)
        (x_label, x_factor), (y_label, y_factor) = (LABELS.get(header, (header, 1.0)) for header in (x, y))
        # what is nowhere positive has no place on a log axis
        there = [any(np.any(columns[header] > 0) for columns in cases) for header in (x, y)]
        scales = ("log" if scales[0] == "log" and there[0] else "linear", "log" if scales[1] == "log" and there[1] else "linear")
        for own, look in zip(cases, looks.each, strict=True):
            shown = np.ones(own[x].size, dtype=bool)
            for header, scale in ((x, scales[0]), (y, scales[1])):
                shown &= (own[header] > 0) | (scale != "log")
            axes.plot(own[x][shown] * x_factor, own[y][shown] * y_factor, linewidth=looks.width, **look)
        for look, one in zip(looks.each, bands, strict=False):
            if one is not None:
                along, low, high = one
                within = np.isfinite(low) & ((along > 0) | (scales[0] != "log")) & ((low > 0) | (scales[1] != "log"))
                shade = {"color": look["color"], "alpha": SHADE, "linewidth": 0.0}
                axes.fill_between(along * x_factor, low * y_factor, high * y_factor, where=within, **shade)
        for index, points in enumerate(measured):
            marker = _points(index, looks.each[points.case]["color"])
            axes.plot(points.x * x_factor, points.y * y_factor, linestyle="none", **marker)
        for case, name, across, up in marks:
            if name in EVENTS:
                axes.plot(across * x_factor, up * y_factor, linestyle="none", **_event(name, looks.each[case]["color"]))
        for (case, name, _, up), span in zip(marks, spans, strict=False):
            if name in EVENTS and span is not None and np.isfinite(span[0]):
                _span(axes, span, x_factor, up * y_factor, looks.each[case]["color"], scales[0] == "log")
        for which, scale in zip("xy", scales, strict=True):
            if scale == "log":
                log_axis(axes, which)
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        if looks.scale is not None:
            _colour_bar(figure, axes, looks.scale)
        if handles and (len(cases) > 1 or measured or marks or banded):
            if rows:
                legend = figure.legend(handles=handles, loc="outside lower center", ncols=columns, fontsize=6.5)
            else:
                legend = axes.legend(handles=handles, loc="best")
            for text in legend.get_texts():
                text.set_parse_math(False)
    return figure


@dataclass(frozen=True, slots=True)
class Looks:
    """Colour and line style of `each` case, the `width` of all lines, the quantity on the colour `scale`, if any, that which the
    line styles tell, and which cases the legend is to name.
    """

    each: list[dict[str, Any]]
    width: float
    scale: Swept | None
    lines: Swept | None
    named: list[int]


def _looks(count: int, swept: Sequence[Swept]) -> Looks:
    """How to tell so many cases apart."""
    if count <= MOST_IN_LEGEND:
        each: list[dict[str, Any]] = [{"color": COLOURS[case], "linestyle": LINES[case % len(LINES)]} for case in range(count)]
        return Looks(each, 1.2, None, None, list(range(count)))
    quantities = sorted(swept, key=lambda one: -len(one.steps))
    if len(quantities) == 1 or (len(quantities) == 2 and len(quantities[1].steps) <= len(LINES)):
        scale, lines = quantities[0], quantities[1] if len(quantities) == 2 else None
        steps, styles = scale.steps, lines.steps if lines is not None else []
        each = []
        dashes: Any
        for case, value in enumerate(scale.values):
            dashes = LINES[styles.index(lines.values[case])] if lines is not None else "-"
            each.append({"color": TEMPERATURES(steps.index(value) / max(1, len(steps) - 1)), "linestyle": dashes})
        return Looks(each, 0.9, scale, lines, [])
    each = [{"color": TEMPERATURES(case / (count - 1)), "linestyle": LINES[case % len(LINES)]} for case in range(count)]
    named = np.unique(np.linspace(0, count - 1, min(count, MOST_NAMED)).astype(int)).tolist()
    return Looks(each, 0.9, None, None, named)


def _points(index: int, colour: Any) -> dict[str, Any]:
    """The markers of measured points."""
    return {"marker": MARKERS[index % len(MARKERS)], "color": colour, "markerfacecolor": "white", "markeredgewidth": 0.8}


def _event(name: str, colour: Any) -> dict[str, Any]:
    """The marker of an event."""
    return {
        "marker": EVENTS[name],
        "color": colour,
        "markersize": 5.5,
        "markerfacecolor": "none",
        "markeredgewidth": 1.1,
        "zorder": 4,
    }


def _span(axes: Axes, span: tuple[float, float], factor: float, up: float, colour: Any, logarithmic: bool) -> None:
    """A bar from the lower to the upper x of a mark; a tip where it goes on beyond the axes."""
    low, high = (end * factor for end in span)
    left, right = axes.get_xlim()
    if logarithmic and low <= 0:
        low = axes.dataLim.minposx
    look: Any = {"color": colour, "linewidth": BAR, "markersize": 4.0, "zorder": 3.5}
    open_end = not np.isfinite(high)
    axes.plot([low, max(low, right) if open_end else high], [up, up], marker="|", markevery=[0] if open_end else [0, 1], **look)
    if open_end:
        axes.set_xlim(left if not logarithmic else None, max(low, right))
        axes.plot([max(low, right)], [up], marker=">", clip_on=False, **look)


def _handles(
    labels: Sequence[str],
    looks: Looks,
    measured: Sequence[Measured],
    marks: Sequence[tuple[int, str, float, float]],
    spread: bool,
) -> list[Artist]:
    """What the legend shows: cases, what the line styles say, measured points, events."""
    handles: list[Artist] = [Line2D([], [], label=_cut(labels[case] or "model"), **looks.each[case]) for case in looks.named]
    if looks.named and len(looks.named) < len(looks.each):
        handles.append(Line2D([], [], linestyle="none", label=f"and {len(looks.each) - len(looks.named)} more"))
    if looks.lines is not None:
        name = looks.lines.label
        for dashes, value in zip(LINES, looks.lines.steps, strict=False):
            look: dict[str, Any] = {"color": "black", "linestyle": dashes, "linewidth": looks.width}
            handles.append(Line2D([], [], **look, label=f"{name} = {value:g}"))
    for index, points in enumerate(measured):
        look = _points(index, looks.each[points.case]["color"])
        # the case first: what is cut off a long label is its end
        case = f"{labels[points.case]}: " if len(looks.each) > 1 and labels[points.case] else ""
        handles.append(Line2D([], [], linestyle="none", label=_cut(case + points.label), **look))
    happened = {name for _, name, _, _ in marks}
    alone = len(looks.each) == 1
    for name in EVENTS:
        if name in happened:
            look = _event(name, looks.each[0]["color"] if alone else "black")
            handles.append(Line2D([], [], linestyle="-" if spread else "none", linewidth=BAR, label=name, **look))
    return handles


def _cut(label: str) -> str:
    """A label that fits the width of a column."""
    return label if len(label) <= LONGEST_LABEL else label[: LONGEST_LABEL - 3] + "..."


def _shape(handles: Sequence[Artist]) -> tuple[int, int]:
    """Rows and columns of a legend below the axes."""
    longest = max(len(str(handle.get_label())) for handle in handles) + 8
    columns = max(1, min(4, len(handles), (LONGEST_LABEL + 12) // longest))
    return -(-len(handles) // columns), columns


def _colour_bar(figure: Figure, axes: Axes, scale: Swept) -> None:
    """The colours of the scale's steps, with as many of its values as can be read."""
    steps = scale.steps
    colours = [TEMPERATURES(index / max(1, len(steps) - 1)) for index in range(len(steps))]
    norm = BoundaryNorm(np.arange(len(steps) + 1) - 0.5, len(steps))
    bar = figure.colorbar(ScalarMappable(norm, ListedColormap(colours)), ax=axes, pad=0.02, aspect=30)
    bar.set_label(scale.label)
    chosen = range(0, len(steps), -(-len(steps) // MOST_TICKS))
    bar.set_ticks(list(chosen), labels=[f"{steps[index]:.4g}" for index in chosen])
    bar.minorticks_off()
    bar.ax.tick_params(length=0)
