"""What the figures of all master curves share: points in the colour of their temperature, and the shift factors with their law."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from numpy.typing import NDArray

from dielast.characterise.mastercurve import MasterCurve
from dielast.plots.style import COLOURS, MARKERS, spread
from dielast.shift import WLF, Arrhenius, ShiftLaw

Array = NDArray[np.float64]
MOST_IN_LEGEND = 6  # temperatures; more are told by a colour bar
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
    """Draw at most `most` of the points that a log axis can hold, in the colour of their temperature."""
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


def shift_factors(axes: Axes, result: MasterCurve) -> None:
    """Draw the measured shift factors with their intervals, and the law."""
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
