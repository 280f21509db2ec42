"""The figure of a master curve of frequency sweeps: measurements, shift factors with the law, moduli and tan delta superposed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from dielast.plots.style import TEMPERATURES, degrees, log_axis, sheet, style
from dielast.plots.superposition import (
    MOST_IN_LEGEND,
    POINTS,
    captioned,
    legend_above,
    points,
    shift_factors,
    where_determined,
)
from dielast.superposition.mastercurve import MasterCurve
from dielast.superposition.measurement import FrequencySweep

MEGA = 1e-6  # from Pa


def plot_oscillation(result: MasterCurve, curves: Sequence[FrequencySweep], title: str | None = None) -> Figure:
    """The measured `curves`, the shift factors with error bars and fitted law, and the master curves of moduli and tan delta."""
    with style():
        figure = sheet(captioned(title, result), 2.0, 6.15)
        parts = figure.subplot_mosaic("rs;mm;tt", height_ratios=(1.0, 1.15, 0.7))
        raw, shift, moduli, tangent = (parts[name] for name in "rsmt")
        tangent.sharex(moduli)
        colour = ScalarMappable(Normalize(result.temperature.min(), result.temperature.max()), TEMPERATURES)
        for curve in sorted(curves, key=lambda curve: curve.temperature):
            index = int(np.argmin(np.abs(result.temperature - curve.temperature)))
            for filled, modulus in ((True, curve.storage_modulus), (False, curve.loss_modulus)):
                points(raw, curve.angular_frequency, MEGA * modulus, colour, curve.temperature, index, filled=filled)
        _superposed(moduli, tangent, result, colour)
        for axes in (raw, moduli):
            log_axis(axes, "x")
            log_axis(axes, "y")
        _tangent_axis(tangent)
        raw.set_xlabel("angular frequency [rad/s]")
        raw.set_ylabel("Young's moduli [MPa]")
        shifted = not np.all(result.vertical_shift == 1)
        moduli.set_ylabel("Young's moduli" + (", shifted [MPa]" if shifted else " [MPa]"))
        moduli.tick_params(labelbottom=False)
        tangent.set_ylabel("tan δ")
        tangent.set_xlabel(f"reduced angular frequency at {degrees(result.reference_temperature)} [rad/s]")
        legend_above(moduli, _entries(), result)
        if result.temperature.size > MOST_IN_LEGEND:
            figure.colorbar(colour, ax=[moduli, tangent], label="temperature [°C]", pad=0.01, aspect=40)
        shift_factors(shift, result)
        figure.align_ylabels([raw, moduli, tangent])
        for letter, axes in zip("abcd", (raw, shift, moduli, tangent), strict=True):
            axes.set_title(f"({letter})", loc="left")
    return figure


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


def _superposed(moduli: Axes, tangent: Axes, result: MasterCurve, colour: ScalarMappable) -> None:
    storage, loss = MEGA * result.storage_modulus, MEGA * result.loss_modulus
    most = max(8, POINTS // result.temperature.size)
    for index, temperature in enumerate(result.temperature):
        here = result.point_temperature == temperature
        across = result.reduced_angular_frequency[here]
        for axes, value, filled in ((moduli, storage, True), (moduli, loss, False), (tangent, loss / storage, True)):
            points(axes, across, value[here], colour, float(temperature), index, most, filled=filled)
    seen = where_determined(result)
    for axes, value in (
        (moduli, MEGA * result.smooth_ordinates[0]),
        (moduli, MEGA * result.smooth_ordinates[1]),
        (tangent, result.smooth_ordinates[1] / result.smooth_ordinates[0]),
    ):
        axes.plot(result.smooth_abscissa[seen], value[seen], "-", color="black", linewidth=0.8)


def _entries() -> list[Artist]:
    """What full and open markers mean."""
    return [
        Line2D([], [], color="black", marker="o", markersize=3, linestyle="none", label="storage"),
        Line2D([], [], color="black", marker="o", markersize=3, linestyle="none", markerfacecolor="white", label="loss"),
        Line2D([], [], color="black", linewidth=0.8, label="fitted"),
    ]
