"""The figures of simulated cases: columns with measured points, and many cycles by their number."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from dielast.plots.events import Curve, View, draw_bands, draw_marks, event_handle
from dielast.plots.looks import Arrangement, Look, Swept, arrange
from dielast.plots.style import (
    LONGEST_LABEL,
    SHADE,
    TEMPERATURES,
    entry,
    grid,
    grid_of,
    legend_below,
    letter,
    open_marker,
    panels as row_of_panels,
    say,
    sheet,
    style,
)
from dielast.plots.texts import FIXED, axis_of, log_axis, number, shortened, typeset

OF_WAVES = "amplitude of the {}", "phase", "work"  # panels of cycles of a waveform,
OF_STEPS = "lowest {}", "highest {}", "work"  # and of repeated steps, which have no amplitude or phase
MOST_MARKED = 12  # points of a line with markers
MOST_TICKS = 8
OF_POINTS: Any = {"linestyle": "none", "markeredgewidth": 0.8}
STILL, BEFORE = 0.005, 3.0  # a log axis begins earlier, by this factor, than a curve has moved by this share of its range
DIM = 0.35  # opacity of a line after a failure
HEIGHTS = {1: 2.7, 2: 2.3, 3: 1.75, 4: 1.5}  # inches of a panel, by the number of panels across
ROOM = {1: 58, 2: 56, 3: 36, 4: 27}  # characters of a line of its title, by the number of panels across


Measured = tuple[int, Curve]
"""The case that was measured, and the measured points."""


def plot_cases(
    curves: Sequence[Curve],
    x: str,
    y: str,
    scales: tuple[str, str] = ("log", "linear"),
    title: str | None = None,
    *,
    measured: Sequence[Measured] = (),
    swept: Sequence[Swept] = (),
    interval: str = "interval",
) -> Figure:
    """The `curves` of column `y` over column `x`, with `measured` points as markers.

    A few cases share a panel, with different colours and line styles; more cases are distributed over panels by the values of
    `swept` quantities, or coloured on a scale if one number is swept. The legend names bands `interval` if they are wide enough to
    be visible.
    """
    labels = [curve.label for curve in curves]
    banded = sum(curve.band is not None for curve in curves)
    with style():
        arranged = arrange(labels, swept, banded)
        view, names = _view(curves, measured, x, y, scales)
        handles = _legend(arranged, labels, measured)
        more = len({mark.name for curve in curves for mark in curve.marks}) + bool(banded)
        rows = grid_of([*handles, *[entry("") for _ in range(more)]], 1 if len(arranged.panels) == 1 else 2)[0]
        below = 0.15 * rows if len(handles) + more > 1 or len(curves) > 1 else 0.0
        figure, panels = _panels(arranged, title, below)
        for axes, panel in zip(panels, arranged.panels, strict=True):
            parts = typeset(panel.title).replace(" ", FIXED).replace(f",{FIXED}", ", ")
            axes.set_title(textwrap.fill(parts, ROOM[arranged.across]).replace(FIXED, " "), loc="left", fontsize=7, pad=3)
            for case in panel.cases:
                _line(axes, view, curves[case], arranged.looks[case], arranged.width)
            for index, (case, points) in enumerate(measured):
                if case in panel.cases:
                    marker = open_marker(index, arranged.looks[case]["color"]) | OF_POINTS
                    axes.plot(points.x * view.factors[0], points.y * view.factors[1], **marker)
        opened = draw_bands(panels, arranged, view, curves)
        happened = draw_marks(panels, arranged, view, curves)
        for which, logarithmic in zip("xy", view.log, strict=True):
            if logarithmic:
                for axes in panels:
                    log_axis(axes, which)
        if view.log[0] and (begins := _beginning(curves, measured, view)) is not None:
            panels[0].set_xlim(left=begins)
        _name_axes(panels, arranged.across, names)
        empty = [axes for axes in panels if not np.isfinite(axes.dataLim.get_points()).all()]
        for axes in empty:
            say(axes, "no value to show")
            if len(empty) == len(panels):
                axes.set(xticks=[], yticks=[])
        handles += [event_handle(name, bar, len(curves) == 1, arranged) for name, bar in happened.items()]
        if opened is not None:
            alone = arranged.looks[0]["color"] if len(curves) == 1 else "black"
            handles.append(Patch(label=interval + opened, facecolor=alone, alpha=SHADE, linewidth=0.0))
        if arranged.scale is not None:
            _colour_bar(figure, panels, arranged.scale)
        if len(curves) == 1 and len(handles) == 1 and arranged.named:
            handles = []
        if handles or len(arranged.shown) < len(curves):
            left_out = f"{len(arranged.shown)} of {len(curves)} cases" if len(arranged.shown) < len(curves) else None
            legend_below(figure, handles, left_out)
    return figure


def _view(
    curves: Sequence[Curve], measured: Sequence[Measured], x: str, y: str, scales: tuple[str, str]
) -> tuple[View, tuple[str, str]]:
    """The axes for these columns, and their labels."""
    along = [curve.x for curve in curves], [curve.y for curve in curves]
    points = [each for _, each in measured]
    across, up = axis_of(x, [*along[0], *(each.x for each in points)]), axis_of(y, [*along[1], *(each.y for each in points)])
    # a log axis needs positive values
    log_x, log_y = (
        scale == "log" and any(bool(np.any(column > 0)) for column in values) for scale, values in zip(scales, along, strict=True)
    )
    return View((across[1], up[1]), (log_x, log_y)), (across[0], up[0])


def _beginning(curves: Sequence[Curve], measured: Sequence[Measured], view: View) -> float | None:
    """Where a log axis of x begins: a little before the first measured point or change of a curve; None if there is none."""
    firsts = [float(points.x[points.x > 0].min()) for _, points in measured if np.any(points.x > 0)]
    for curve in curves:
        across, up = curve.x, curve.y
        seen = view.seen(across, up) & (across > 0)
        if np.any(seen):
            shown = np.log(up[seen]) if view.log[1] else up[seen]
            moved = np.abs(shown - shown[0]) > STILL * np.ptp(shown)
            place = int(np.argmax(moved))
            still, changed = across[seen][place - 1], across[seen][place]
            # of rows that are far apart, the one before the change is shown as well
            firsts.append(float(still if still < changed / BEFORE else changed) if moved.any() else np.inf)
    first = min(firsts, default=np.inf)
    return view.factors[0] * first / BEFORE if np.isfinite(first) else None


def _panels(arranged: Arrangement, title: str | None, below: float) -> tuple[Figure, list[Axes]]:
    """The figure and the axes of its panels, which share their axes, with so much room `below` for a legend."""
    count, across = len(arranged.panels), arranged.across
    figure = sheet(title, 1.0 if count == 1 else 2.0, HEIGHTS[across] * -(-count // across) + below)
    panels = grid(figure, count, across, sharex=True, sharey=True)
    for lowest in panels[-across:]:
        lowest.tick_params(labelbottom=True)
    if across > 2:
        for axes in panels:
            # more numbers would overlap
            axes.locator_params(axis="x", nbins=4)
    return figure, panels


def _name_axes(panels: Sequence[Axes], across: int, names: tuple[str, str]) -> None:
    for place, axes in enumerate(panels):
        if place + across >= len(panels):
            axes.set_xlabel(names[0])
        if place % across == 0:
            axes.set_ylabel(names[1])


def _line(axes: Axes, view: View, curve: Curve, look: Look, width: float) -> None:
    """Draw a case, dimmed from the row at which it failed; few points have markers, as a single point makes no line."""
    across, up, failed = curve.x, curve.y, curve.failed
    seen = view.seen(across, up)
    marker: Any = {}
    if np.count_nonzero(seen) <= MOST_MARKED:
        marker = {"marker": "o", "markersize": 3.0}
    parts: list[tuple[slice, Any]] = [(slice(0, None), {})]
    if failed is not None and failed < across.size - 1:
        parts = [(slice(0, failed + 1), {}), (slice(failed, None), {"alpha": DIM})]
    for part, more in parts:
        here = seen[part]
        axes.plot(
            np.where(here, across[part], np.nan)[_trimmed(here)] * view.factors[0],
            np.where(here, up[part], np.nan)[_trimmed(here)] * view.factors[1],
            linewidth=width,
            **marker,
            **look,
            **more,
        )


def _trimmed(seen: NDArray[np.bool_]) -> slice:
    """From the first to the last visible point."""
    where = np.flatnonzero(seen)
    return slice(int(where[0]), int(where[-1]) + 1) if where.size else slice(0, 0)


def _legend(arranged: Arrangement, labels: Sequence[str], measured: Sequence[Measured]) -> list[Artist]:
    """The legend entries for cases and measured points."""
    handles: list[Artist] = []
    count = len(labels)
    for case, name in arranged.named.items():
        handles.append(entry(label=_fitting(name or "model"), linewidth=arranged.width, **arranged.looks[case]))
    if 0 < len(arranged.named) < count and len(arranged.panels) == 1:
        handles.append(entry(linestyle="none", label=f"and {count - len(arranged.named)} more"))
    for index, (case, points) in enumerate(measured):
        if case in arranged.shown:
            marker = open_marker(index, arranged.looks[case]["color"]) | OF_POINTS
            parts = [labels[case]] if count > 1 and labels[case] else []
            handles.append(entry(label=_fitting(*parts, points.label), **marker))
    return handles


def _fitting(*parts: str) -> str:
    """A label that fits into a column, of parts that share its width: a short part leaves its room to the others."""
    texts, room = [typeset(part) for part in parts], LONGEST_LABEL - 2 * (len(parts) - 1)
    for left, place in enumerate(sorted(range(len(texts)), key=lambda place: len(texts[place]))):
        texts[place] = shortened(texts[place], room // (len(texts) - left))
        room -= len(texts[place])
    return ": ".join(texts)


def _colour_bar(figure: Figure, panels: Sequence[Axes], scale: Swept) -> None:
    """Draw the colour scale, with as many values as are legible."""
    steps = scale.levels
    colours = [TEMPERATURES(index / max(1, len(steps) - 1)) for index in range(len(steps))]
    norm = BoundaryNorm(np.arange(len(steps) + 1) - 0.5, len(steps))
    bar = figure.colorbar(ScalarMappable(norm, ListedColormap(colours)), ax=list(panels), pad=0.02, aspect=30)
    bar.set_label(scale.label)
    chosen = range(0, len(steps), -(-len(steps) // MOST_TICKS))
    bar.set_ticks(list(chosen), labels=[number(steps[index]) for index in chosen])
    bar.minorticks_off()
    bar.ax.tick_params(length=0)


def plot_cycles(
    cases: Sequence[Mapping[str, NDArray[np.float64]]],
    labels: Sequence[str],
    swept: Sequence[Swept],
    measured: str,
    title: str | None = None,
) -> Figure:
    """Amplitude of the `measured` quantity, phase, and work of each cycle, or its lowest and highest value and the work where steps
    are repeated; each case maps headers to columns (cycles,).
    """
    with style():
        arranged = arrange(labels, swept)
        shown = arranged.shown if len(arranged.panels) == 1 else list(range(len(cases)))
        headers, quantity = {header.partition(" [")[0]: header for header in cases[0]}, axis_of(measured)[0].partition(" [")[0]
        panels = OF_WAVES if "amplitude" in headers else OF_STEPS
        figure, axes = row_of_panels(len(panels), title)
        for place, words in zip(axes, panels, strict=True):
            header = headers[words.split()[0]]
            label, factor = axis_of(header, [cases[case][header] for case in shown])
            for case in shown:
                place.plot(cases[case]["cycle"], factor * cases[case][header], linewidth=arranged.width, **arranged.looks[case])
            place.set_xlabel("cycle")
            place.set_ylabel(words.format(quantity) + _unit(label) if "{}" in words else label)
            if max(float(np.max(cases[case]["cycle"], initial=1.0)) for case in shown) > 10:
                place.set_xscale("log")
                log_axis(place, "x")
        letter(axes)
        named = {case: name for case, name in arranged.named.items() if name}
        handles = [entry(label=name, linewidth=arranged.width, **arranged.looks[case]) for case, name in named.items()]
        if handles and len(cases) > 1:
            legend_below(figure, handles, None)
    return figure


def _unit(label: str) -> str:
    """The unit of a label, in brackets."""
    _, bracket, rest = label.partition(" [")
    return bracket + rest
