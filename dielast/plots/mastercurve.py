"""The figure of a master curve: measurements, shift factors with the law, master curve (Figs. 4, 5 of DOI 10.1115/1.4030850)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dielast.characterise.mastercurve import MasterCurve
from dielast.characterise.measurement import CreepCurve, FrequencySweep, RelaxationCurve
from dielast.plots.style import COLOURS, MARKERS, TEMPERATURES, degrees, log_axis, sheet, spread, style
from dielast.shift import WLF, Arrhenius, ShiftLaw

Array = NDArray[np.float64]
Measurement = RelaxationCurve | FrequencySweep | CreepCurve
MOST_IN_LEGEND = 6  # temperatures; more are told by a colour bar
POINTS = 300  # about so many on the master curve, so that they do not run together
AXES = {
    RelaxationCurve: ("time [s]", "Young's relaxation modulus [Pa]"),
    CreepCurve: ("time [s]", "tensile creep compliance [1/Pa]"),
}


def plot_master_curve(result: MasterCurve, curves: Sequence[Measurement], title: str | None = None) -> Figure:
    """The measured `curves`, the shift factors with error bars and fitted law, and the master curve with the fitted one."""
    sweeps = [curve for curve in curves if isinstance(curve, FrequencySweep)]
    if sweeps:
        from dielast.plots.oscillation import plot_oscillation

        return plot_oscillation(result, sweeps, title)
    return _plot_over_time(result, [curve for curve in curves if not isinstance(curve, FrequencySweep)], title)


def _plot_over_time(result: MasterCurve, curves: Sequence[RelaxationCurve | CreepCurve], title: str | None) -> Figure:
    with style():
        figure = sheet(title, 2.0, 4.6)
        parts = figure.subplot_mosaic([["raw", "shift"], ["master", "master"]], height_ratios=(1.0, 1.15))
        raw, shift, master = (parts[name] for name in ("raw", "shift", "master"))
        colour = ScalarMappable(Normalize(result.temperature.min(), result.temperature.max()), TEMPERATURES)
        for curve in sorted(curves, key=lambda curve: curve.temperature):
            index = int(np.argmin(np.abs(result.temperature - curve.temperature)))
            value = curve.compliance if isinstance(curve, CreepCurve) else curve.modulus
            _points(raw, curve.time, value, colour, curve.temperature, index)
        few = result.temperature.size <= MOST_IN_LEGEND
        for index, temperature in enumerate(result.temperature):
            here = result.point_temperature == temperature
            most = max(8, POINTS // result.temperature.size)
            label = degrees(float(temperature)) if few else None
            position, value = result.reduced_abscissa[here], result.ordinates[0][here]
            _points(master, position, value, colour, float(temperature), index, most, label)
        seen = where_determined(result)
        master.plot(
            result.smooth_abscissa[seen], result.smooth_ordinates[0][seen], "-", color="black", linewidth=0.8, label="fitted curve"
        )
        for axes in (raw, master):
            log_axis(axes, "x")
            log_axis(axes, "y")
        across, up = AXES.get(type(curves[0]), AXES[RelaxationCurve]) if curves else AXES[RelaxationCurve]
        raw.set_xlabel(across)
        raw.set_ylabel(up)
        master.set_xlabel(f"reduced time at {degrees(result.reference_temperature)} [s]")
        shifted = not np.all(result.vertical_shift == 1)
        master.set_ylabel(up.replace(" [", ", shifted [") if shifted else up)
        master.legend(loc="best")
        if not few:
            figure.colorbar(colour, ax=master, label="temperature [°C]", pad=0.01, aspect=25)
        _shift_factors(shift, result)
        for letter, axes in zip("abc", (raw, shift, master), strict=True):
            axes.set_title(f"({letter})", loc="left")
    return figure


def where_determined(result: MasterCurve) -> NDArray[np.bool_]:
    """Which points of the fitted curve lie among points of temperatures whose shift is determined: only there is it one curve."""
    adrift = [entry.temperature for entry in result.undetermined]
    reduced = result.reduced_abscissa[~np.isin(result.point_temperature, adrift)]
    slack = 1 + 1e-6
    return (result.smooth_abscissa >= reduced.min() / slack) & (result.smooth_abscissa <= reduced.max() * slack)


def _points(
    axes: Axes,
    position: Array,
    value: Array,
    colour: ScalarMappable,
    temperature: float,
    index: int,
    most: int = 40,
    label: str | None = None,
    *,
    filled: bool = True,
) -> None:
    """At most `most` of the points that a log axis can hold, in the colour of their temperature."""
    position, value = position[value > 0], value[value > 0]
    chosen = spread(np.log10(position), most)
    own = colour.to_rgba(np.array(temperature))
    axes.plot(
        position[chosen],
        value[chosen],
        MARKERS[index % len(MARKERS)],
        color=own,
        markersize=2.6,
        markeredgewidth=0 if filled else 0.6,
        markerfacecolor=own if filled else "white",
        linestyle="none",
        label=label,
    )


def _shift_factors(axes: Axes, result: MasterCurve) -> None:
    known = np.isfinite(result.log10_shift_factor) & np.isfinite(result.log10_shift_factor_stderr)
    measured = axes.errorbar(
        result.temperature[known],
        result.log10_shift_factor[known],
        1.96 * result.log10_shift_factor_stderr[known],
        fmt="o",
        color="black",
        markersize=3 if result.temperature.size < 30 else 2,
        markerfacecolor="white",
        markeredgewidth=0.7,
        elinewidth=0.8,
        capsize=1.5,
        zorder=3,
    )
    law = result.shift_fit.law
    span = np.linspace(result.temperature[0], result.temperature[-1], 200)
    (line,) = axes.plot(span, law.log10_shift_factor(span), "-", color=COLOURS[1])
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set_xlabel("temperature [°C]")
    axes.set_ylabel("log$_{10}$ shift factor")
    axes.legend([measured, line], ["measured, with 95 % interval", _law(law)], loc="upper right")


def _law(law: ShiftLaw) -> str:
    match law:
        case WLF():
            return f"WLF, $C_1$ = {law.C1:.4g}, $C_2$ = {law.C2:.4g} K"
        case Arrhenius():
            return f"Arrhenius, $E_a$ = {law.activation_energy / 1e3:.4g} kJ/mol"
        case _:
            return "linear in between"
