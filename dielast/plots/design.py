"""The figure of a design: the voltage that each film takes to its goal, and how long it lives under that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from dielast.plots.quantities import unit_for
from dielast.plots.style import (
    COLOURS,
    LINES,
    MARKERS,
    SHADE,
    degrees,
    lasting,
    legend_below,
    log_axis,
    number,
    panels,
    spread_indices,
    style,
)
from dielast.simulate.design import FAILS_FIRST, OUT_OF_REACH, YES, Design

Array = NDArray[np.float64]
MOST_LINES = 7
ROW = 0.045  # of the height of the axes: the marks of a line below the times shown
ABOVE = 1.5  # times the horizon: the marks of a line, and of the next one times that
CROSSES: Mapping[str, str] = {FAILS_FIRST: "x", OUT_OF_REACH: "+"}


@dataclass(frozen=True, slots=True, eq=False)
class _Axis:
    """What films differ in: its label, and the value (films,) of each, with how a legend says that."""

    label: str
    values: Array
    texts: Sequence[str]

    @property
    def levels(self) -> Array:
        """The values, each once, ascending."""
        return np.unique(self.values)


def plot_design(result: Design, title: str | None = None, interval: str | None = None, share: float = 0.05) -> Figure:
    """Voltage and life over the goal, where there are several, or else over what films differ in most, a line for the rest.

    With draws, the voltage has bars of the `interval`, and the life is the one that a `share` of films does not reach; a thick line
    is the longest life of all films for each goal. Films that live longer than the horizon are above its line, and those that do
    not reach the goal are crosses at the foot.
    """
    along, others = _axes(result)
    combinations = np.unique(np.stack([axis.values for axis in others]), axis=1).T if others else np.zeros((1, 0))
    shown = combinations[spread_indices(len(combinations), MOST_LINES)]
    life = result.life
    with style():
        figure, (left, right) = panels(2, title, height=2.9)
        unit, factor = unit_for("V", float(np.nanmax(result.voltage, initial=1.0)))
        if along.label.startswith(result.goal.replace("_", " ")):
            _frontier(right, along, life, result.horizon)
        handles = []
        for index, combination in enumerate(shown):
            alike = np.ones(result.target.shape, dtype=bool)
            for axis, value in zip(others, combination, strict=True):
                alike &= axis.values == value
            films = np.flatnonzero(alike)
            films = films[np.argsort(along.values[films], kind="stable")]
            look: Any = {"color": COLOURS[index % len(COLOURS)], "linestyle": LINES[index % len(LINES)], "linewidth": 1.1}
            look |= {"marker": MARKERS[index % len(MARKERS)], "markerfacecolor": "white"}
            _voltages(left, along, result, films, factor, look)
            _lives(right, along, result, life, films, look, index)
            if others:
                label = ", ".join(axis.texts[int(films[0])] for axis in others)
                handles.append(Line2D([], [], label=label, **look))
        left.set_ylabel(f"voltage [{unit}]")
        name = "time to failure" if result.drawn is None else f"life that {number(100 * share)} % of films do not reach"
        right.set_ylabel(f"{name} [s]")
        _time_axis(right, result, life, len(shown))
        if np.isnan(result.voltage).all():
            left.set_yticks([])
            left.text(0.5, 0.5, "no film reaches the goal", transform=left.transAxes, ha="center", va="center")
        for label, place in zip("ab", (left, right), strict=True):
            place.set_xlabel(along.label)
            room = 0.04 * float(np.ptp(along.levels)) or 0.1
            place.set_xlim(along.levels[0] - room, along.levels[-1] + room)
            place.set_title(f"({label})", loc="left")
        handles += _marks(result, along, interval, len(combinations) - len(shown))
        if handles:
            legend_below(figure, handles)
    return figure


def _axes(result: Design) -> tuple[_Axis, list[_Axis]]:
    """What is along the axis, and what else films differ in."""
    name = result.goal.replace("_", " ")
    strain = result.goal == "area_strain"
    target = 100 * result.target if strain else result.target
    after = f" after {lasting(result.at)}"
    said = [f"{name} {number(value)}" + " %" * strain for value in target.tolist()]
    goal = _Axis(f"{name}{after}" + " [%]" * strain, np.round(target, 9), said)
    first, second = result.prestretch.T
    pairs = [number(a) if a == b else f"{number(a)} \N{MULTIPLICATION SIGN} {number(b)}" for a, b in result.prestretch.tolist()]
    axes = [
        _Axis("prestretch", first, [f"prestretch {pair}" for pair in pairs]),
        _Axis("temperature [°C]", result.temperature, [degrees(value) for value in result.temperature.tolist()]),
        _Axis("thickness [mm]", 1e3 * result.thickness, [f"{number(1e3 * value)} mm" for value in result.thickness.tolist()]),
    ]
    if result.electrode_share is not None:
        texts = [f"electrode share {number(value)}" for value in result.electrode_share.tolist()]
        axes.insert(1, _Axis("electrode share", result.electrode_share, texts))
    if np.any(first != second):
        axes.insert(1, _Axis("prestretch of axis 2", second, [""] * second.size))
    if goal.levels.size > 1:
        return goal, [axis for axis in axes if axis.levels.size > 1]
    along = max(axes, key=lambda axis: axis.levels.size)
    return along, [axis for axis in axes if axis is not along and axis.levels.size > 1]


def _voltages(axes: Axes, along: _Axis, result: Design, films: NDArray[np.intp], factor: float, look: Any) -> None:
    axes.plot(along.values[films], result.voltage[films] * factor, **look)
    if result.drawn is not None:
        low, high = (bound[films] * factor for bound in result.drawn.voltage)
        known = np.isfinite(low) & np.isfinite(high)
        axes.vlines(along.values[films][known], low[known], high[known], color=look["color"], linewidth=1.0)


def _lives(axes: Axes, along: _Axis, result: Design, life: Array, films: NDArray[np.intp], look: Any, index: int) -> None:
    place, time = along.values[films], life[films]
    axes.plot(place, np.where(np.isfinite(time), np.maximum(time, 1e-12), np.nan), **look)
    lasts = np.isposinf(time)
    axes.plot(place[lasts], np.full(int(lasts.sum()), result.horizon * ABOVE ** (index + 1)), **look | {"linestyle": "none"})
    for reason, cross in CROSSES.items():
        lost = result.reached[films] == reason
        at = {"transform": axes.get_xaxis_transform(), "linestyle": "none", "marker": cross, "color": look["color"]}
        axes.plot(place[lost], np.full(int(lost.sum()), ROW * (index + 1)), markersize=4.0, **at)


def _frontier(axes: Axes, along: _Axis, life: Array, horizon: float) -> None:
    """The longest life of all films at each goal."""
    best = [np.max(np.where(along.values == level, np.nan_to_num(life, nan=-1.0), -1.0)) for level in along.levels]
    longest = np.minimum(np.where(np.array(best) > 0, best, np.nan), horizon)
    axes.plot(along.levels, longest, color="0.4", alpha=2 * SHADE, linewidth=5.0, solid_capstyle="round", zorder=1)


def _time_axis(axes: Axes, result: Design, life: Array, lines: int) -> None:
    known = life[np.isfinite(life) & (life > 0)]
    low = min(float(known.min(initial=np.inf)), result.horizon / 10)
    axes.set_yscale("log")
    lasting_on = lines + 1 if np.any(np.isposinf(life)) else 1
    axes.set_ylim(low / 4, result.horizon * ABOVE**lasting_on)
    log_axis(axes, "y")
    axes.axhline(result.horizon, color="0.5", linestyle=":", linewidth=0.8)


def _marks(result: Design, along: _Axis, interval: str | None, left_out: int) -> list[Line2D]:
    """What marks mean that are not of a film."""
    plain: Any = {"color": "0.35", "linestyle": "none"}
    marks = []
    if np.any(np.isposinf(result.life)):
        marks.append(
            Line2D([], [], color="0.5", linestyle=":", linewidth=0.8, label=f"above: longer than {lasting(result.horizon)}")
        )
    for reason, cross in CROSSES.items():
        if np.any(result.reached == reason):
            marks.append(Line2D([], [], marker=cross, label=reason.removeprefix("no: "), **plain))
    if interval is not None and np.any(result.reached == YES):
        marks.append(Line2D([], [], color="0.35", linewidth=1.0, label=f"bars: {interval}"))
    if along.label.startswith(result.goal.replace("_", " ")):
        marks.append(Line2D([], [], color="0.4", alpha=2 * SHADE, linewidth=5.0, label="frontier: the longest life"))
    if left_out:
        marks.append(Line2D([], [], linestyle="none", label=f"{left_out} more films are not shown"))
    return marks
