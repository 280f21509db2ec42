"""The operating map: time to failure over voltage and prestretch as bands of colour, with lines of equal stretch on top."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from dielast.plots.failure_map import AT_ONCE, UNFINISHED, Cells, is_map, patch
from dielast.plots.lifetimes import film_in_words
from dielast.plots.style import TEMPERATURES, entry, grid, letter, line_look, row_legend, sheet, spread_indices, style
from dielast.plots.texts import YEAR, degrees, lasting, number, unit_for
from dielast.simulate.failure_map import FailureMap

# ends of the bands of time in s: rounded seconds, minutes, hours, days and years
DAY = 86400.0
SHORT_TIMES = [10.0**power for power in range(-12, 2)]
TIMES = (*SHORT_TIMES, 60.0, 600.0, 3600.0, DAY / 4, DAY, 7 * DAY, 30 * DAY, *(YEAR * 10**power for power in range(9)))
MOST_BANDS = 9
MOST_PANELS = 4
MOST_LINES = 7
SHORTEST = 0.15  # share of the width of the axes: the frame would cut the label of a shorter line, which lies in a corner
SURVIVES = "#FFFFFF"
LIFE = LinearSegmentedColormap.from_list("life", [*TEMPERATURES(np.linspace(0, 1, 6)), (0.80, 0.90, 0.45, 1.0)])


def plot_operating_map(result: FailureMap, title: str | None = None) -> Figure:
    """A panel for each time at which the stretch is known, or for each temperature at the last of these times: the time to failure
    over voltage and prestretch as bands, with lines of equal relative stretch of axis 1 where films live to that time. If there
    are too few prestretches or voltages for a map, or further differences between films: the stretch over voltage, by film.
    """
    names = list(result.relative_stretch)
    temperatures = result.temperature.size
    panels = [(0, name) for name in names] if temperatures == 1 else [(i, names[-1]) for i in range(temperatures)]
    panels = [panels[index] for index in spread_indices(len(panels), MOST_PANELS)]
    across = min(len(panels), 2)
    with style():
        height = 3.3 if len(panels) == 1 else 3.0
        wide = 1.45 if len(panels) == 1 else across + 0.15
        figure = sheet(title, wide, height * -(-len(panels) // across))
        axes = grid(figure, len(panels), across, sharex=True, sharey=True)
        draw = _maps if is_map(result) else _curves
        draw(figure, axes, result, panels)
        unit, _ = unit_for("V", float(result.voltage.max()))
        for place in axes[-across:]:
            place.set_xlabel(f"voltage [{unit}]")
        for place in axes[::across]:
            place.set_ylabel("prestretch" if is_map(result) else "relative stretch")
        for place, (temperature, name) in zip(axes, panels, strict=True):
            at = f", {degrees(result.temperature[temperature])}" if temperatures > 1 else ""
            place.set_title(f"stretch after {name}{at}", loc="right")
        if len(panels) > 1:
            letter(axes)
    return figure


def _maps(figure: Figure, axes: Sequence[Axes], result: FailureMap, panels: Sequence[tuple[int, str]]) -> None:
    """Draw the maps, with one scale of time."""
    cells = Cells.of(result)
    places = cells.voltage, cells.prestretch
    levels = _levels(result)
    colours = LIFE(np.linspace(0, 1, max(len(levels) - 1, 2)))
    modes: dict[str, Patch] = {}
    lined = False
    for place, (temperature, name) in zip(axes, panels, strict=True):
        time, mode = result.time_to_failure[temperature, cells.order], result.failure_mode[temperature, cells.order]
        place.set_facecolor(SURVIVES)
        decades = _decades(time, mode, levels)
        if len(levels) > 1:
            place.contourf(*places, decades, levels=np.log10(levels), colors=[tuple(c) for c in colours], zorder=0.5)
        unknown = mode == "unfinished"
        regions = ((unknown, UNFINISHED, "not finished"), (time == 0, AT_ONCE, "fails at once"))
        drawn = [cells.fill(place, where, colour, label) for where, colour, label in regions if where.any()]
        drawn += cells.hatch(place, mode, result.times, LIFE(0.2))
        modes |= {str(handle.get_label()): handle for handle in drawn}
        lined |= _stretch_lines(place, *places, result.relative_stretch[name][0, temperature, cells.order])
        # contours end at the centres of the cells that pcolor draws
        place.set_xlim(cells.voltage[0], cells.voltage[-1])
        place.set_ylim(cells.prestretch[0], cells.prestretch[-1])
    if len(levels) > 1:
        norm = BoundaryNorm(np.log10(levels), len(levels) - 1)
        shown = LinearSegmentedColormap.from_list("bands", colours, N=len(levels) - 1)
        bar = figure.colorbar(
            ScalarMappable(norm, shown), ax=list(axes), pad=0.02, aspect=28, spacing="uniform", label="time to failure"
        )
        bar.set_ticks(np.log10(levels).tolist(), labels=[lasting(level) for level in levels])
        bar.ax.tick_params(which="both", length=0)
    white = patch(SURVIVES, f"lives longer than {lasting(result.horizon)}")
    line = entry(color="black", linewidth=1.0, label="relative stretch")
    handles = [line] * lined + [white] * bool(np.any(result.failure_mode == "none")) + list(modes.values())
    row_legend(figure, handles, min(len(handles), 3), loc="outside lower center", fontsize=7)


def _levels(result: FailureMap) -> NDArray[np.float64]:
    """The ends in s of the bands of time; the last is the horizon."""
    time = result.time_to_failure[np.isfinite(result.time_to_failure) & (result.time_to_failure > 0)]
    if not time.size:
        return np.zeros(0)
    between = np.array([level for level in TIMES if time.min() < level < min(result.horizon, time.max())])
    between = between[spread_indices(between.size, MOST_BANDS - 1)] if between.size else between
    below = max((level for level in TIMES if level <= time.min()), default=float(time.min()))
    above = min((level for level in (*TIMES, result.horizon) if level >= time.max()), default=result.horizon)
    return np.array([below, *between, min(above, result.horizon)])


def _decades(time: NDArray[np.float64], mode: NDArray[np.str_], levels: NDArray[np.float64]) -> Any:
    """The logarithm of the time to failure; for films that survive a little above the last level, for films that fail at once that
    of the first level.
    """
    if not levels.size:
        return np.ma.masked_invalid(np.full(time.shape, np.nan))
    low, high = np.log10(levels[[0, -1]])
    with np.errstate(divide="ignore"):
        decades = np.where(mode == "none", high + 1.0, np.log10(time))
    return np.ma.masked_invalid(np.where(mode == "unfinished", np.nan, np.maximum(decades, low + 1e-9)))


def _stretch_levels(stretch: NDArray[np.float64]) -> NDArray[np.float64]:
    """Round relative stretches between the least and the largest."""
    known = stretch[np.isfinite(stretch)]
    if known.size < 2 or np.ptp(known) <= 1e-9:
        return np.zeros(0)
    ticks = np.asarray(MaxNLocator(nbins=9, steps=[1, 2, 2.5, 5, 10]).tick_values(float(known.min()), float(known.max())))
    return np.asarray(ticks[(ticks > known.min()) & (ticks < known.max())])


def _stretch_lines(axes: Axes, voltage: NDArray[np.float64], prestretch: NDArray[np.float64], stretch: NDArray[np.float64]) -> bool:
    """Lines of equal stretch, with labels where these fit; returns whether there are any lines."""
    levels = _stretch_levels(stretch)
    if not levels.size:
        return False
    cells = np.ma.masked_invalid(stretch)
    lines = axes.contour(voltage, prestretch, cells, levels=levels, colors="black", linewidths=1.0, linestyles="solid")
    lines.set(path_effects=[withStroke(linewidth=2.2, foreground="white", alpha=0.75)])
    size = np.array([np.ptp(voltage), np.ptp(prestretch)])
    lengths = [float(np.sum(np.hypot(*(np.diff(path.vertices, axis=0) / size).T))) for path in lines.get_paths()]
    long = [level for level, length in zip(levels.tolist(), lengths, strict=True) if length > SHORTEST]
    for text in axes.clabel(lines, long, fmt=number, fontsize=7, inline_spacing=4) if long else []:
        text.set_path_effects([withStroke(linewidth=2.0, foreground="white")])
    return True


def _curves(figure: Figure, axes: Sequence[Axes], result: FailureMap, panels: Sequence[tuple[int, str]]) -> None:
    """The stretch over voltage of some films, with a mark at the highest voltage under which a film lives to the `moment`."""
    _, factor = unit_for("V", float(result.voltage.max()))
    chosen = spread_indices(len(result.prestretch), MOST_LINES)
    handles, crossed = [], False
    for index, film in enumerate(chosen):
        line = line_look(index)
        for place, (temperature, name) in zip(axes, panels, strict=True):
            stretch = result.relative_stretch[name][0, temperature, film]
            lived = np.flatnonzero(np.isfinite(stretch))
            place.plot(result.voltage * factor, stretch, **line, linewidth=1.2)
            if lived.size and lived[-1] + 1 < stretch.size:
                end, crossed = lived[-1], True
                place.plot(
                    result.voltage[end] * factor, stretch[end], marker="x", color=line["color"], linestyle="none", markersize=4.5
                )
            if lived.size == 1:
                place.plot(result.voltage[lived] * factor, stretch[lived], marker=".", color=line["color"])
        handles.append(entry(label=film_in_words(result, film), **line))
    if crossed:
        cross = "highest voltage under which the film lives to this time"
        handles.append(entry(marker="x", color="0.3", linestyle="none", markersize=4.5, label=cross))
    row_legend(figure, handles, min(len(handles), 2), loc="outside lower center", fontsize=6.5)
