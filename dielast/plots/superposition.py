"""What the figures of all master curves share: points in the colour of their temperature, and the shift factors with their law."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from dielast.plots.style import COLOURS, MARKERS, TEMPERATURES, spread
from dielast.plots.texts import degrees, typeset
from dielast.superposition.result import MasterCurve

MOST_IN_LEGEND = 6  # temperatures; more are shown by a colour bar
HEIGHT = 95.0  # points, about, of the axes of the shift factors
POINTS = 300  # about so many on the master curve, so that they do not run together


def where_determined(result: MasterCurve) -> NDArray[np.bool_]:
    """Which points of the fitted curve lie among points of temperatures whose shift is determined: only there is it one curve."""
    adrift = [entry.temperature for entry in result.undetermined]
    reduced = result.reduced_abscissa[~np.isin(result.point_temperature, adrift)]
    slack = 1 + 1e-6
    seen = (result.smooth_abscissa >= reduced.min() / slack) & (result.smooth_abscissa <= reduced.max() * slack)
    return np.asarray(seen)


def points(
    axes: Axes,
    position: NDArray[np.float64],
    value: NDArray[np.float64],
    colour: ScalarMappable,
    temperature: float,
    index: int,
    most: int = 40,
    *,
    filled: bool = True,
) -> None:
    """Draw at most `most` of the points that a log axis can hold, in the colour of their temperature."""
    position, value = position[value > 0], value[value > 0]
    chosen = spread(np.log10(position), most)
    rgba = colour.to_rgba(np.array(temperature))
    axes.plot(
        position[chosen],
        value[chosen],
        MARKERS[index % len(MARKERS)],
        color=rgba,
        markersize=2.6,
        markeredgewidth=0 if filled else 0.6,
        markerfacecolor=rgba if filled else "white",
        linestyle="none",
    )


def captioned(title: str | None, result: MasterCurve) -> str:
    """The title with a line below it that says which temperatures were measured."""
    low, high = degrees(float(result.temperature.min())), degrees(float(result.temperature.max()))
    measured = f"{result.temperature.size} temperatures from {low} to {high}" if low != high else low
    line = f"{measured}, reference temperature {degrees(result.reference_temperature)}"
    return f"{title}\n{line}" if title else line


def legend_above(axes: Axes, entries: Sequence[Artist], result: MasterCurve) -> None:
    """A legend above the axes, where no point can be, of these entries and of the temperatures if they are few."""
    entries = list(entries)
    if result.temperature.size <= MOST_IN_LEGEND:
        places = (result.temperature - result.temperature[0]) / max(float(np.ptp(result.temperature)), 1e-300)
        for index, (temperature, place) in enumerate(zip(result.temperature, places, strict=True)):
            rgba, marker = TEMPERATURES(float(place)), MARKERS[index % len(MARKERS)]
            label = degrees(float(temperature))
            entries.append(Line2D([], [], color=rgba, marker=marker, markersize=3, linestyle="none", label=label))
    spacing = {"columnspacing": 1.0, "handletextpad": 0.2, "borderaxespad": 0.2}
    axes.legend(handles=entries, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(entries), **spacing)


def shift_factors(axes: Axes, result: MasterCurve) -> None:
    """Draw the measured shift factors, with their intervals where these are wider than the markers, and the law."""
    known = np.isfinite(result.log10_shift_factor) & np.isfinite(result.log10_shift_factor_stderr)
    size = 3.0 if result.temperature.size < 30 else 2.0
    half = 1.96 * result.log10_shift_factor_stderr[known]
    shifts = result.log10_shift_factor[known]
    seen = bool(half.size) and bool(np.max(half) > 0.5 * size / HEIGHT * max(float(np.ptp(shifts)), 1e-300))
    marker: Any = {"fmt": "o", "color": "black", "markersize": size, "markerfacecolor": "white", "markeredgewidth": 0.7}
    measured = axes.errorbar(
        result.temperature[known], shifts, half if seen else None, elinewidth=0.8, capsize=1.5, zorder=3, **marker
    )
    law = result.shift_fit.law
    used = result.point_temperature  # those without points may be beyond the pole of the law
    span = np.linspace(used.min(), used.max(), 200)
    (line,) = axes.plot(span, law.log10_shift_factor(span), "-", color=COLOURS[1])
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set_xlabel("temperature [°C]")
    axes.set_ylabel("log$_{10}$ shift factor")
    names = ["measured, with 95 % interval" if seen else "measured", typeset(law.label())]
    place: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2}
    axes.legend([measured, line], names, **place)
