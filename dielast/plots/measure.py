"""The figures of `measure`: stretches over time, and the photographs with the outlines in them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dielast.plots.style import COLOURS, entry, legend_below, open_marker, panels, sheet, spread_indices, style
from dielast.readings.photographs.series import BREAKDOWN, DOUBTFUL, LOST, OK, Stretches

LEVEL, QUANTILE = "90 %", 1.645
MOST = 600  # photographs in a contact sheet
HIGHEST = 30.0  # inches
LOOKS = {OK: (COLOURS[3], "-"), DOUBTFUL: (COLOURS[1], (0, (2, 1)))}
_UNITS = ((3 * 86400.0, "d", 86400.0), (3 * 3600.0, "h", 3600.0), (300.0, "min", 60.0), (0.0, "s", 1.0))


def plot_stretches(result: Stretches, title: str | None = None) -> Figure:
    """The stretches along both axes over time with their intervals, and what happened to the electrode."""
    unit, size = next((name, size) for least, name, size in _UNITS if np.ptp(result.time) >= least)
    time, state = result.time / size, np.array(result.state)
    with style():
        figure, (axes,) = panels(1, title)
        handles: list[Any] = []
        for axis, name in enumerate(("axis 1", "axis 2")):
            values, bars = result.stretch[:, axis], QUANTILE * result.stderr[:, axis]
            for kind, look in ((OK, open_marker(axis, COLOURS[2 * axis])), (DOUBTFUL, {"marker": "x+"[axis], "color": "0.6"})):
                shown = state == kind
                if shown.any():
                    axes.errorbar(time[shown], values[shown], bars[shown], linestyle="", linewidth=0.8, capsize=1.5, **look)
                    label = f"along {name}" if kind == OK else f"doubtful, along {name}"
                    handles.append(entry(linestyle="", label=label, **look))
        lost = time[state == LOST]
        if lost.size:
            low, high = axes.get_ylim()
            axes.vlines(lost, low, low + 0.07 * (high - low), color="0.4", linewidth=0.8)
            axes.set_ylim(low, high)
            handles.append(entry(marker="|", linestyle="", color="0.4", label="lost (at the lower edge)"))
        for kind, number in result.events.items():
            line: Any = "--" if kind == BREAKDOWN else ":"
            at = time[number] if number == 0 else 0.5 * (time[number - 1] + time[number])
            axes.axvline(at, color="0.4", linestyle=line, linewidth=0.8)
            handles.append(entry(color="0.4", linestyle=line, linewidth=0.8, label=kind))
        axes.set(xlabel=f"time [{unit}]", ylabel="relative stretch")
        legend_below(figure, handles, f"bars: {LEVEL} intervals")
    return figure


def plot_photographs(result: Stretches, pictures: Sequence[tuple[NDArray[np.uint8], int]], title: str | None = None) -> Figure:
    """Every photograph of a series with the outline drawn over it; `pictures` are reduced ones, and how many times. Of more than
    `MOST` photographs so many, and all that are doubtful or lost are among them.
    """
    state, count = result.state, len(pictures)
    numbers = list(range(count))
    if count > MOST:
        flagged = [number for number in numbers if state[number] != OK][:MOST]
        numbers = sorted({*flagged, *spread_indices(count, MOST - len(flagged))})
    across = int(np.clip(np.ceil(np.sqrt(1.3 * len(numbers))), min(4, len(numbers)), 12))
    down = -(-len(numbers) // across)
    shapes = [pictures[number][0].shape for number in numbers]
    height, width = (max((shape[side] for shape in shapes), default=1) or 1 for side in (0, 1))
    # room for a line of text below each
    cell_x, cell_y = 1.06 * width, height + 0.24 * width
    inches = max(0.8, 6.8 / across)
    with style():
        figure = sheet(title, max(2.0, across * inches / 3.4), min(HIGHEST, down * inches * cell_y / cell_x + 0.5))
        axes = figure.subplots()
        axes.set_axis_off()
        outlines: dict[str, list[NDArray[np.float64]]] = {OK: [], DOUBTFUL: []}
        for place, number in enumerate(numbers):
            (picture, factor), outline = pictures[number], result.outlines[number]
            x, y = place % across * cell_x, place // across * cell_y
            if picture.size:
                extent = (x - 0.5, x + picture.shape[1] - 0.5, y + picture.shape[0] - 0.5, y - 0.5)
                axes.imshow(picture, cmap="gray", vmin=0, vmax=255, extent=extent, interpolation="antialiased")
            if outline.ellipse is not None:
                around = outline.ellipse.around(90)[0]
                # the middle of a reduced pixel is that of a block
                points = (np.concatenate([around, around[:1]]) - (factor - 1) / 2) / factor
                outlines[state[number]].append(points + np.array([x, y]))
            else:
                axes.plot([x, x + width], [y, y + height], color=COLOURS[1], linewidth=0.7)
                axes.plot([x, x + width], [y + height, y], color=COLOURS[1], linewidth=0.7)
            name = result.file[number].rsplit("/", 1)[-1]
            words = f"{name if len(name) < 22 else '…' + name[-20:]}\n{result.time[number]:g} s"
            words += "" if state[number] == OK else f", {state[number]}"
            axes.text(x, y + height, words, va="top", fontsize=min(6.0, 4.2 * inches), linespacing=1.0, parse_math=False)
        for kind, drawn in outlines.items():
            colour, line = LOOKS[kind]
            axes.add_collection(LineCollection(drawn, colors=[colour], linestyles=[line], linewidths=0.9))
        axes.set_xlim(-1, across * cell_x)
        axes.set_ylim(down * cell_y, -1)
        axes.set_aspect("equal")
    return figure
