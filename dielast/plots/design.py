"""The figure of a design: the voltage that takes each film to its goal, and its life under this voltage."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from dielast.plots.looks import Swept
from dielast.plots.style import entry, legend_below, letter, line_look, open_marker, panels, say, spread_indices, style
from dielast.plots.texts import degrees, lasting, limits, log_axis, number, prestretched, ticks_within, unit_for
from dielast.simulate.design import FAILS_FIRST, OUT_OF_REACH, Design

MOST_LINES = 7
ROOM = 1.6  # factor by which the time axis extends beyond the longest and below the shortest time
WIDTH = 180.0  # points: about the width of the axes
ROW = 0.045  # share of the height of the axes: a row of marks in a strip
LEAST_SEEN = 0.02  # share of the height of the axes: the marker hides a shorter bar
WORDS = 0.09  # share of the height of the axes: the text of a strip
APART = 4.6  # points between marks that would coincide
BARS_APART = 1.8  # points
FRONTIER: Any = {"color": "0.8", "linewidth": 5.0, "solid_capstyle": "round"}
AT_ONCE = "fails at once"
CROSSES: Mapping[str, str] = {FAILS_FIRST: "x", OUT_OF_REACH: "+", AT_ONCE: "*"}
MEANINGS: Mapping[str, str] = {
    "x": "\N{MULTIPLICATION SIGN} fails first",
    "+": "+ out of reach",
    "*": "\N{ASTERISK OPERATOR} fails at once",
}


def plot_design(result: Design, title: str | None = None, interval: str | None = None, share: float = 0.05) -> Figure:
    """Voltage and life over the goal, if there are several, else over the quantity with most values; a line for each other film.

    With draws, the voltage has bars of the `interval`, side by side where there are several lines, and the life is that which a
    `share` of the films does not reach. A thick line is the longest life of all films for each goal. Films that live longer than
    the horizon have marks in a strip above the times; films that do not reach the goal have crosses in a strip below.
    """
    along, others = _axes(result)
    place, levels = np.array(along.values), np.array(along.levels)
    differing = np.array([axis.values for axis in others]).T if others else np.zeros((result.target.size, 1))
    combinations, inverse = np.unique(differing, axis=0, return_inverse=True)
    line = inverse.ravel()  # the shape of the inverse depends on the version of NumPy
    shown = _shown(result, line, len(combinations))
    life = result.life
    with style():
        figure, (left, right) = panels(2, title, height=2.9)
        unit, factor = unit_for("V", float(np.nanmax(result.voltage, initial=1.0)))
        frontier = along.label.startswith(result.goal.replace("_", " ")) and _frontier(right, place, life)
        handles, lines, looks = [], [], []
        for index, combination in enumerate(shown):
            films = np.flatnonzero(line == combination)
            films = films[np.argsort(place[films], kind="stable")]
            look: Any = line_look(index) | {"linewidth": 1.1}
            look |= open_marker(index, look["color"])
            aside = BARS_APART * (index - 0.5 * (len(shown) - 1))
            _voltages(left, place, result, films, factor, look, aside)
            lines.append(films)
            looks.append(look)
            if others:
                label = ", ".join(text for axis in others if (text := axis.texts[int(films[0])]))
                handles.append(entry(label=label, **look))
        _lives(right, place, result, life, lines, looks)
        left.set_ylabel(f"voltage [{unit}]")
        name = "time to failure" if result.drawn is None else f"life that {number(100 * share)} % of films do not reach"
        right.set_ylabel(f"{name} [s]")
        if np.isnan(result.voltage).all():
            left.set_yticks([])
            say(left, "no film reaches the goal")
        letter((left, right))
        room = max(0.04, 0.5 * APART * (_side_by_side(levels, len(shown)) + 1) / WIDTH) * float(np.ptp(levels)) or 0.1
        for axes in (left, right):
            axes.set(xlabel=along.label, xlim=(levels[0] - room, levels[-1] + room))
        bars = result.drawn is not None and _wider_than_marks(left, *(factor * bound for bound in result.drawn.voltage))
        beside = ", side by side" if len(shown) > 1 else ""
        handles += _marks(frontier, f"{interval}{beside}" if bars else None, len(combinations) - len(shown))
        if handles:
            legend_below(figure, handles)
    return figure


def _axes(result: Design) -> tuple[Swept, list[Swept]]:
    """The quantity along the horizontal axis, and the others in which films differ."""
    name = result.goal.replace("_", " ")
    strain = result.goal == "area_strain"
    target = 100 * result.target if strain else result.target
    after = f" after {lasting(result.at)}"
    texts = [f"{name} {number(value)}" + " %" * strain for value in target.tolist()]
    goal = _swept(f"{name}{after}" + " [%]" * strain, np.round(target, 9), texts)
    first, second = result.prestretch.T
    axes = [
        _swept("prestretch", first, map(prestretched, result.prestretch)),
        _swept("temperature [°C]", result.temperature, map(degrees, result.temperature.tolist())),
        _swept("thickness [mm]", 1e3 * result.thickness, [f"{number(1e3 * value)} mm" for value in result.thickness.tolist()]),
    ]
    if result.electrode_share is not None:
        texts = [f"electrode share {number(value)}" for value in result.electrode_share.tolist()]
        axes.insert(1, _swept("electrode share", result.electrode_share, texts))
    if np.any(first != second):
        axes.insert(1, _swept("prestretch along axis 2", second, [""] * second.size))
    along = goal if len(goal.levels) > 1 else max(axes, key=lambda axis: len(axis.levels))
    return along, [axis for axis in axes if axis is not along and len(axis.levels) > 1]


def _swept(label: str, values: NDArray[np.float64], texts: Iterable[str]) -> Swept:
    return Swept(label, tuple(values.tolist()), tuple(texts))


def _shown(result: Design, line: NDArray[np.intp], lines: int) -> list[int]:
    """The lines that are drawn, of so many `lines`; `line` (films,) is that of each film. If there are too many: that of the best
    film for every goal at every temperature, and some of the others.
    """
    best = np.unique(np.stack([result.target, result.temperature], axis=1), axis=0, return_index=True)[1]
    first = list(dict.fromkeys(line[best].tolist()))[:MOST_LINES]
    others = [index for index in range(lines) if index not in first]
    return sorted([*first, *(others[index] for index in spread_indices(len(others), MOST_LINES - len(first)))])


def _voltages(
    axes: Axes, along: NDArray[np.float64], result: Design, films: NDArray[np.intp], factor: float, look: Any, aside: float
) -> None:
    """Draw the voltages, with bars a few points `aside`, where they do not hide those of the other films."""
    axes.plot(along[films], result.voltage[films] * factor, **look)
    if result.drawn is not None:
        low, high = (bound[films] * factor for bound in result.drawn.voltage)
        known = np.isfinite(low) & np.isfinite(high)
        shifted = axes.transData + ScaledTranslation(aside / 72, 0, axes.figure.dpi_scale_trans)
        place, ends = along[films][known], (low[known], high[known])
        axes.vlines(place, *ends, color=look["color"], linewidth=1.0, transform=shifted, zorder=1.5)
        axes.update_datalim(np.column_stack((np.tile(place, 2), np.concatenate(ends))))
        axes.autoscale_view()


def _untimed(result: Design, life: NDArray[np.float64]) -> tuple[NDArray[np.str_], NDArray[np.str_]]:
    """Marks (films,) of the films without a time: above the times of those that live longer, and below; "" if there is none."""
    below = np.array([CROSSES.get(reason, "") for reason in result.reached.tolist()])
    below[life == 0] = CROSSES[AT_ONCE]
    return np.where(np.isposinf(life), "film", ""), below


def _side_by_side(levels: NDArray[np.float64], lines: int) -> int:
    """The number of marks that fit side by side before the next value along the axis; further marks stand in rows."""
    gaps = np.diff(levels) / max(float(np.ptp(levels)), 1e-9)
    return max(1, min(lines, int(WIDTH * float(gaps.min(initial=1.0)) / APART) - 1))


def _lives(
    axes: Axes,
    along: NDArray[np.float64],
    result: Design,
    life: NDArray[np.float64],
    lines: Sequence[NDArray[np.intp]],
    looks: Sequence[Any],
) -> None:
    """The times, above them marks of films that live longer than the horizon, and below them those of films without a life."""
    above, below = _untimed(result, life)
    known = life[np.isfinite(life) & (life > 0)]
    shown = (float(known.min()) / ROOM if known.size else min(result.at, result.horizon / 100), result.horizon)
    if not np.any(above != "") and known.size:
        shown = shown[0], float(known.max()) * ROOM
    side = _side_by_side(np.unique(along), len(lines))
    height = WORDS + ROW * (-(-len(lines) // side) + 0.5)
    aside_by = " (marks side by side)" if side > 1 else ""
    axes.set_ylim(*limits(shown, *(height if np.any(marks != "") else 0.0 for marks in (above, below))))
    log_axis(axes, "y")
    ticks_within(axes, shown)
    for films, look in zip(lines, looks, strict=True):
        timed = np.where(np.isfinite(life[films]) & (life[films] > 0), life[films], np.nan)
        axes.plot(along[films], timed, **look)
    crosses = ", ".join(MEANINGS[mark] for mark in CROSSES.values() if mark in below)
    strips = (
        (above, shown[1], 1 - height, 1 - 0.6 * WORDS, f"longer than {lasting(result.horizon)}{aside_by}"),
        (below, shown[0], 0.0, height - 0.5 * WORDS, crosses + aside_by),
    )
    for marks, edge, foot, middle, words in strips:
        if not np.any(marks != ""):
            continue
        axes.add_patch(Rectangle((0, foot), 1, height, transform=axes.transAxes, color="0.93", linewidth=0.0, zorder=0))
        axes.axhline(edge, color="0.5", linewidth=0.6)
        axes.text(0.5, middle, words, transform=axes.transAxes, ha="center", va="center", fontsize=6.5, color="0.25")
        for index, (films, look) in enumerate(zip(lines, looks, strict=True)):
            row, place = divmod(index, side)
            aside = (place - 0.5 * (min(side, len(lines)) - 1)) * APART / 72
            shift = ScaledTranslation(aside, 0, axes.figure.dpi_scale_trans)
            at: Any = {"transform": axes.get_xaxis_transform() + shift, "linestyle": "none"}
            for marker in dict.fromkeys(marks[films].tolist()):
                some = films[marks[films] == marker]
                mark = {} if marker == "film" else {"marker": marker, "markersize": 4.0}
                if marker:
                    axes.plot(along[some], np.full(some.size, foot + ROW * (row + 0.75)), **look | at | mark)


def _frontier(axes: Axes, along: NDArray[np.float64], life: NDArray[np.float64]) -> bool:
    """Draw the longest life of all films at each goal if it is known at two goals; returns whether it is."""
    lives = np.where(np.isnan(life), 0.0, life)
    levels = np.unique(along)
    best = np.array([np.max(lives[along == level]) for level in levels])
    known = np.where(np.isfinite(best) & (best > 0), best, np.nan)
    if np.count_nonzero(np.isfinite(known)) < 2:
        return False
    axes.plot(levels, known, **FRONTIER)
    axes.plot(levels, known, linestyle="none", marker="o", **{"color": FRONTIER["color"], "markersize": 5.0}, zorder=1)
    return True


def _wider_than_marks(axes: Axes, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Whether a bar from `low` to `high` (films,) can be seen beside its marker."""
    width = (high - low)[np.isfinite(low) & np.isfinite(high)]
    return bool(np.any(width > LEAST_SEEN * np.ptp(axes.get_ylim())))


def _marks(frontier: bool, interval: str | None, left_out: int) -> list[Line2D]:
    """Legend entries for marks that belong to no single film."""
    marks = []
    if interval is not None:
        marks.append(entry(color="0.35", linewidth=1.0, label=f"bars: {interval}"))
    if frontier:
        marks.append(entry(label="frontier: the longest life", **FRONTIER))
    if left_out:
        marks.append(entry(linestyle="none", label=f"{left_out} more films are not shown"))
    return marks
