"""The figure of a master curve: measurements, shift factors with the law, master curve (Figs. 4, 5 of DOI 10.1115/1.4030850)."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from dielast.plots.style import TEMPERATURES, letter, sheet, style
from dielast.plots.superposition import (
    MOST_IN_LEGEND,
    POINTS,
    captioned,
    legend_above,
    points,
    shift_factors,
    where_determined,
)
from dielast.plots.texts import degrees
from dielast.plots.ticks import log_axis
from dielast.superposition.result import MasterCurve


@runtime_checkable
class MeasuredCurve(Protocol):
    """The measurement at one temperature, as the figure shows it."""

    @property
    def temperature(self) -> float:
        """In degC."""

    @property
    def columns(self) -> NDArray[np.float64]:
        """Abscissa and ordinates, (1 + c, n)."""


def plot_master_curve(result: MasterCurve, curves: Sequence[MeasuredCurve], title: str | None = None) -> Figure:
    """The measured `curves`, the shift factors with error bars and the fitted law, and the master curve with the fitted curve.

    The storage and loss moduli of frequency sweeps have tan delta below them.
    """
    kind = result.kind
    swept, factor = len(kind.ordinates) > 1, kind.label_factor
    label = "Young's moduli [MPa]" if swept else kind.label
    along, unit = kind.abscissa[0].replace("_", " "), kind.abscissa[1]
    with style():
        figure = sheet(captioned(title, result), 2.0, 6.15 if swept else 4.95)
        ratios = (1.0, 1.15, 0.7) if swept else (1.0, 1.15)
        parts = figure.subplot_mosaic("rs;mm;tt" if swept else "rs;mm", height_ratios=ratios)
        raw, shift, master = (parts[name] for name in "rsm")
        below = [parts["t"]] if swept else []
        for tangent in below:
            tangent.sharex(master)
        colour = ScalarMappable(Normalize(result.temperature.min(), result.temperature.max()), TEMPERATURES)
        for curve in sorted(curves, key=lambda curve: curve.temperature):
            index = int(np.argmin(np.abs(result.temperature - curve.temperature)))
            abscissa, *ordinates = curve.columns
            for channel, values in enumerate(ordinates):
                points(raw, abscissa, factor * values, colour, curve.temperature, index, filled=channel == 0)
        fitted = _superposed([master, *below], result, colour)
        for axes in (raw, master):
            log_axis(axes, "x")
            log_axis(axes, "y")
        raw.set_xlabel(f"{along} [{unit}]")
        raw.set_ylabel(label)
        shifted = not np.all(result.vertical_shift == 1)
        master.set_ylabel(label.replace(" [", ", shifted [") if shifted else label)
        for tangent in below:
            _tangent_axis(tangent)
            tangent.set_ylabel("tan δ")
            master.tick_params(labelbottom=False)
        [master, *below][-1].set_xlabel(f"reduced {along} at {degrees(result.reference_temperature)} [{unit}]")
        legend_above(master, _entries() if swept else fitted, result)
        if result.temperature.size > MOST_IN_LEGEND:
            beside = [master, *below]
            figure.colorbar(colour, ax=beside, label="temperature [°C]", pad=0.01, aspect=40 if swept else 25)
        shift_factors(shift, result)
        if swept:
            figure.align_ylabels([raw, master, *below])
        letter((raw, shift, master, *below))
    return figure


def _superposed(panels: Sequence[Axes], result: MasterCurve, colour: ScalarMappable) -> list[Artist]:
    """Draw the shifted points and the fitted curves, for sweeps with tan delta in the second panel; returns the fitted curves."""

    def rows(ordinates: np.ndarray) -> list[tuple[Axes, np.ndarray, bool]]:
        drawn = [(panels[0], result.kind.label_factor * values, k == 0) for k, values in enumerate(ordinates)]
        return drawn + [(tangent, ordinates[1] / ordinates[0], True) for tangent in panels[1:]]

    most = max(8, POINTS // result.temperature.size)
    for index, temperature in enumerate(result.temperature):
        here = result.point_temperature == temperature
        for axes, values, filled in rows(result.ordinates):
            points(axes, result.reduced_abscissa[here], values[here], colour, float(temperature), index, most, filled=filled)
    seen, lines = where_determined(result), []
    for axes, values, _ in rows(result.smooth_ordinates):
        lines += axes.plot(result.smooth_abscissa[seen], values[seen], "-", color="black", linewidth=0.8, label="fitted curve")
    return list(lines)


def _tangent_axis(axes: Axes) -> None:
    """A log axis with labels at 1, 2 and 5 if there are few decades, and a linear one if it is too short for two of them."""
    log_axis(axes, "y")
    low, high = axes.get_ylim()
    if high / low >= 100:
        return
    locator = LogLocator(subs=(1, 2, 5))
    axes.yaxis.set_minor_formatter(NullFormatter())
    if np.count_nonzero([low <= tick <= high for tick in locator.tick_values(low, high)]) < 2:
        axes.set_yscale("linear")
        return
    axes.yaxis.set_major_locator(locator)
    axes.yaxis.set_major_formatter("{x:g}")


def _entries() -> list[Artist]:
    """The legend of full and open markers."""
    return [
        Line2D([], [], color="black", marker="o", markersize=3, linestyle="none", label="storage"),
        Line2D([], [], color="black", marker="o", markersize=3, linestyle="none", markerfacecolor="white", label="loss"),
        Line2D([], [], color="black", linewidth=0.8, label="fitted"),
    ]
