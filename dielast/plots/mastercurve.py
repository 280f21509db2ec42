"""The figure of a master curve: raw curves, shifted curves, shift factors with the law (Figs. 4 and 5 of DOI 10.1115/1.4030850)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from dielast.characterise.mastercurve import MasterCurve, RelaxationCurve
from dielast.plots.style import COLOURS, MARKERS, TEMPERATURES, log_axis, panels, spread, style
from dielast.shift import WLF, Arrhenius


def plot_master_curve(result: MasterCurve, curves: Sequence[RelaxationCurve], title: str | None = None) -> Figure:
    """Raw `curves`, the master curve and the shift factors with error bars and fitted law."""
    with style():
        figure, (raw, master, shift) = panels(3, title, widths=(1.0, 1.15, 0.95))
        colour = ScalarMappable(Normalize(result.temperature.min(), result.temperature.max()), TEMPERATURES)
        for index, curve in enumerate(sorted(curves, key=lambda curve: curve.temperature)):
            positive = curve.modulus > 0
            _points(raw, curve.time[positive], curve.modulus[positive], colour, curve.temperature, index)
        for index, temperature in enumerate(result.temperature):
            here = result.point_temperature == temperature
            _points(master, result.reduced_time[here], result.relaxation_modulus[here], colour, float(temperature), index)
        master.plot(result.smooth_reduced_time, result.smooth_modulus, "-", color="black", linewidth=0.8, label="fitted curve")
        figure.colorbar(colour, ax=[raw, master], label="temperature [°C]", pad=0.01, aspect=30)
        for axes in (raw, master):
            log_axis(axes, "x")
            log_axis(axes, "y")
        raw.set_ylabel("Young's relaxation modulus [Pa]")
        master.set_ylabel("reduced modulus [Pa]")
        raw.set_xlabel("time [s]")
        master.set_xlabel(f"reduced time at {result.reference_temperature:g} °C [s]")
        master.legend(loc="best")
        _shift_factors(shift, result)
        for label, axes in zip("abc", (raw, master, shift), strict=True):
            axes.set_title(f"({label})", loc="left")
    return figure


def _points(axes: Axes, x: np.ndarray, y: np.ndarray, colour: ScalarMappable, temperature: float, index: int) -> None:
    chosen = spread(np.log10(x))
    axes.plot(
        x[chosen],
        y[chosen],
        MARKERS[index % len(MARKERS)],
        color=colour.to_rgba(np.array(temperature)),
        markersize=2.2,
        markeredgewidth=0,
        linestyle="none",
    )


def _shift_factors(axes: Axes, result: MasterCurve) -> None:
    known = np.isfinite(result.log10_shift_factor)
    axes.errorbar(
        result.temperature[known],
        result.log10_shift_factor[known],
        1.96 * result.log10_shift_factor_stderr[known],
        fmt="o",
        color="black",
        markersize=3,
        markerfacecolor="white",
        elinewidth=0.8,
        capsize=1.5,
        zorder=3,
        label="measured, with 95 % interval",
    )
    law = result.shift_fit.law
    span = np.linspace(result.temperature[0], result.temperature[-1], 200)
    label = "linear in between"
    match law:
        case WLF():
            label = f"WLF, $C_1$ = {law.C1:.4g}, $C_2$ = {law.C2:.4g} K"
        case Arrhenius():
            label = f"Arrhenius, $E_a$ = {law.activation_energy / 1e3:.4g} kJ/mol"
    axes.plot(span, law.log10_shift_factor(span), "-", color=COLOURS[1], label=label)
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set_xlabel("temperature [°C]")
    axes.set_ylabel("log$_{10}$ shift factor")
    axes.legend(loc="upper right")
