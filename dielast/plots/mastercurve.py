"""The figure of a master curve: measurements, shift factors with the law, master curve (Figs. 4, 5 of DOI 10.1115/1.4030850)."""

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from numpy.typing import NDArray

from dielast.plots.style import COLOURS, MARKERS, TEMPERATURES, entry, letter, sheet, spread, style
from dielast.plots.texts import degrees, log_axis, typeset
from dielast.relaxation.superposition.result import MasterCurve

MOST_IN_LEGEND = 6  # temperatures; more are shown by a colour bar
HEIGHT = 95.0  # points, about, of the axes of the shift factors
POINTS = 300  # about so many on the master curve, so that they do not run together


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
        figure = sheet(_captioned(title, result), 2.0, 6.15 if swept else 4.95)
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
                _points(raw, abscissa, factor * values, colour, curve.temperature, index, filled=channel == 0)
        fitted = _superposed([master, *below], result, colour)
        for axes in (raw, master):
            log_axis(axes, "x")
            log_axis(axes, "y")
        raw.set(xlabel=f"{along} [{unit}]", ylabel=label)
        shifted = not np.all(result.vertical_shift == 1)
        master.set_ylabel(label.replace(" [", ", shifted [") if shifted else label)
        for tangent in below:
            _tangent_axis(tangent)
            tangent.set_ylabel("tan δ")
            master.tick_params(labelbottom=False)
        [master, *below][-1].set_xlabel(f"reduced {along} at {degrees(result.reference_temperature)} [{unit}]")
        _legend_above(master, _entries() if swept else fitted, result)
        if result.temperature.size > MOST_IN_LEGEND:
            panels = [master, *below]
            figure.colorbar(colour, ax=panels, label="temperature [°C]", pad=0.01, aspect=40 if swept else 25)
        _shift_factors(shift, result)
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
            _points(axes, result.reduced_abscissa[here], values[here], colour, float(temperature), index, most, filled=filled)
    seen, lines = _where_determined(result), []
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
        entry(color="black", marker="o", markersize=3, linestyle="none", label="storage"),
        entry(color="black", marker="o", markersize=3, linestyle="none", markerfacecolor="white", label="loss"),
        entry(color="black", linewidth=0.8, label="fitted"),
    ]


def _where_determined(result: MasterCurve) -> NDArray[np.bool_]:
    """Which points of the fitted curve lie among points of temperatures whose shift is determined: only there is it one curve."""
    adrift = [entry.temperature for entry in result.undetermined]
    reduced = result.reduced_abscissa[~np.isin(result.point_temperature, adrift)]
    slack = 1 + 1e-6
    seen = (result.smooth_abscissa >= reduced.min() / slack) & (result.smooth_abscissa <= reduced.max() * slack)
    return np.asarray(seen)


def _points(
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


def _captioned(title: str | None, result: MasterCurve) -> str:
    """The title with a line below it that says which temperatures were measured."""
    low, high = degrees(float(result.temperature.min())), degrees(float(result.temperature.max()))
    measured = f"{result.temperature.size} temperatures from {low} to {high}" if low != high else low
    line = f"{measured}, reference temperature {degrees(result.reference_temperature)}"
    return f"{title}\n{line}" if title else line


def _legend_above(axes: Axes, entries: Sequence[Artist], result: MasterCurve) -> None:
    """A legend above the axes, where no point can be, of these entries and of the temperatures if they are few."""
    entries = list(entries)
    if result.temperature.size <= MOST_IN_LEGEND:
        places = (result.temperature - result.temperature[0]) / max(float(np.ptp(result.temperature)), 1e-300)
        for index, (temperature, place) in enumerate(zip(result.temperature, places, strict=True)):
            rgba, marker = TEMPERATURES(float(place)), MARKERS[index % len(MARKERS)]
            label = degrees(float(temperature))
            entries.append(entry(color=rgba, marker=marker, markersize=3, linestyle="none", label=label))
    spacing = {"columnspacing": 1.0, "handletextpad": 0.2, "borderaxespad": 0.2}
    axes.legend(handles=entries, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(entries), **spacing)


def _shift_factors(axes: Axes, result: MasterCurve) -> None:
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
    axes.set(xlabel="temperature [°C]", ylabel="log$_{10}$ shift factor")
    names = ["measured, with 95 % interval" if seen else "measured", typeset(law.label())]
    place: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "borderaxespad": 0.2}
    axes.legend([measured, line], names, **place)
