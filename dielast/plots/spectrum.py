"""The figure of a relaxation spectrum: the moduli, and the model over the master curve (Fig. 6 of DOI 10.1115/1.4030850)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from dielast.characterise.spectrum import SpectrumFit
from dielast.plots.style import COLOURS, log_axis, panels, spread, style


def plot_spectrum(result: SpectrumFit, title: str | None = None) -> Figure:
    """The discrete spectrum, and the model's relaxation modulus over the measured one."""
    with style():
        figure, (lines, curve) = panels(2, title)
        spectrum = result.spectrum
        present = spectrum.shear_modulus > 0
        tau, mu = spectrum.relaxation_time[present], spectrum.shear_modulus[present]
        floor = 10 ** (np.floor(np.log10(mu.min())) - 0.5) if mu.size else 1.0
        lines.vlines(tau, floor, mu, color="0.6", linewidth=0.8)
        lines.plot(tau, mu, "o", color=COLOURS[2], label=f"{len(spectrum)} branches")
        if result.equilibrium_shear_modulus > 0:
            lines.axhline(result.equilibrium_shear_modulus, color=COLOURS[1], linestyle="--", label="equilibrium modulus")
        lines.set_xlabel("relaxation time [s]")
        lines.set_ylabel("shear modulus [Pa]")
        shown = spread(np.log10(result.reduced_time), 80)
        curve.plot(
            result.reduced_time[shown],
            result.measured[shown],
            "o",
            color="0.45",
            markerfacecolor="white",
            markersize=3.5,
            markeredgewidth=0.7,
            label="master curve",
        )
        curve.plot(result.reduced_time, result.model, "-", color=COLOURS[0], label="discrete model")
        curve.set_xlabel("reduced time [s]")
        curve.set_ylabel("Young's relaxation modulus [Pa]")
        for axes in (lines, curve):
            log_axis(axes, "x")
            log_axis(axes, "y")
        lines.set_ylim(floor, 3 * max(np.max(mu, initial=floor), result.equilibrium_shear_modulus))
        lines.legend(loc="best")
        curve.legend(loc="best")
        lines.set_title("(a)", loc="left")
        curve.set_title("(b)", loc="left")
    return figure
