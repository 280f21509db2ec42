"""The figure of a master curve: measurements, shift factors with the law, master curve (Figs. 4, 5 of DOI 10.1115/1.4030850)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from dielast.plots.oscillation import plot_oscillation
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
from dielast.superposition.measurement import CreepCurve, FrequencySweep, RelaxationCurve

Measurement = RelaxationCurve | FrequencySweep | CreepCurve
# label, and the factor from SI into the unit shown
AXES = {
    RelaxationCurve: ("Young's relaxation modulus [MPa]", 1e-6),
    CreepCurve: ("tensile creep compliance [1/MPa]", 1e6),
}


def plot_master_curve(result: MasterCurve, curves: Sequence[Measurement], title: str | None = None) -> Figure:
    """The measured `curves`, the shift factors with error bars and fitted law, and the master curve with the fitted one."""
    sweeps = [curve for curve in curves if isinstance(curve, FrequencySweep)]
    if sweeps:
        return plot_oscillation(result, sweeps, title)
    return _plot_over_time(result, [curve for curve in curves if not isinstance(curve, FrequencySweep)], title)


def _plot_over_time(result: MasterCurve, curves: Sequence[RelaxationCurve | CreepCurve], title: str | None) -> Figure:
    with style():
        figure = sheet(captioned(title, result), 2.0, 4.95)
        up, factor = AXES.get(type(curves[0]), AXES[RelaxationCurve]) if curves else AXES[RelaxationCurve]
        parts = figure.subplot_mosaic([["raw", "shift"], ["master", "master"]], height_ratios=(1.0, 1.15))
        raw, shift, master = (parts[name] for name in ("raw", "shift", "master"))
        colour = ScalarMappable(Normalize(result.temperature.min(), result.temperature.max()), TEMPERATURES)
        for curve in sorted(curves, key=lambda curve: curve.temperature):
            index = int(np.argmin(np.abs(result.temperature - curve.temperature)))
            value = curve.compliance if isinstance(curve, CreepCurve) else curve.modulus
            points(raw, curve.time, factor * value, colour, curve.temperature, index)
        few = result.temperature.size <= MOST_IN_LEGEND
        for index, temperature in enumerate(result.temperature):
            here = result.point_temperature == temperature
            most = max(8, POINTS // result.temperature.size)
            position, value = result.reduced_abscissa[here], factor * result.ordinates[0][here]
            points(master, position, value, colour, float(temperature), index, most)
        seen = where_determined(result)
        smooth = factor * result.smooth_ordinates[0][seen]
        fitted = master.plot(result.smooth_abscissa[seen], smooth, "-", color="black", linewidth=0.8, label="fitted curve")
        for axes in (raw, master):
            log_axis(axes, "x")
            log_axis(axes, "y")
        raw.set_xlabel("time [s]")
        raw.set_ylabel(up)
        master.set_xlabel(f"reduced time at {degrees(result.reference_temperature)} [s]")
        shifted = not np.all(result.vertical_shift == 1)
        master.set_ylabel(up.replace(" [", ", shifted [") if shifted else up)
        legend_above(master, fitted, result)
        if not few:
            figure.colorbar(colour, ax=master, label="temperature [°C]", pad=0.01, aspect=25)
        shift_factors(shift, result)
        for letter, axes in zip("abc", (raw, shift, master), strict=True):
            axes.set_title(f"({letter})", loc="left")
    return figure
