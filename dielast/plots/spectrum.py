"""The figure of a relaxation spectrum: the moduli, and the model over the master curve (Fig. 6 of DOI 10.1115/1.4030850)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dielast.plots.style import COLOURS, letter, panels, row_legend, spread, style
from dielast.plots.texts import degrees, log_axis
from dielast.relaxation.continuous import ContinuousSpectrum
from dielast.relaxation.interconversion import response
from dielast.relaxation.reduce import Reduction
from dielast.relaxation.result import SpectrumFit

MEGA = 1e-6  # from Pa


def plot_spectrum(
    result: SpectrumFit,
    title: str | None = None,
    *,
    continuous: ContinuousSpectrum | None = None,
    reduction: Reduction | None = None,
    reference_temperature: float | None = None,
    measured: str = "master curve",
) -> Figure:
    """The discrete spectrum, with the continuous and the reduced spectrum if given, and the model over the measured curve.

    `reference_temperature` in degC is that of the reduced time, for the label of its axis; `measured` says what the points are: a
    master curve has a reduced time, a test at one temperature does not, and "" is no points.
    """
    with style():
        figure, (lines, curve) = panels(2, title, height=3.1)
        spectrum = result.spectrum
        present = MEGA * spectrum.shear_modulus > 1e-300  # an axis ends there, and so does what a branch adds to any curve
        tau, mu = spectrum.relaxation_time[present], MEGA * spectrum.shear_modulus[present]
        floor = 10 ** (np.floor(np.log10(mu.min())) - 0.5) if mu.size else MEGA
        equilibrium = MEGA * result.equilibrium_shear_modulus
        lines.vlines(tau, floor, mu, color="0.6", linewidth=0.8)
        zeros = len(spectrum) - tau.size
        clipped = min(result.clipped_branches, zeros)
        count = f"{len(spectrum)} branches" + (f", {zeros - clipped} fitted as zero" if zeros > clipped else "")
        count += f", {clipped} negative, set to zero" if clipped else ""
        lines.plot(tau, mu, "o", color=COLOURS[2], markersize=3.5 if tau.size <= 60 else 2.0, label=count)
        if equilibrium > 0:
            lines.axhline(equilibrium, color=COLOURS[1], linestyle="--", label="equilibrium modulus")
        lines.set(xlabel="relaxation time [s]", ylabel="shear modulus [MPa]")
        if continuous is not None:
            density = np.where(MEGA * continuous.density > floor, MEGA * continuous.density, np.nan)
            lines.plot(continuous.relaxation_time, density, "-", color=COLOURS[0], label="continuous, per unit of ln time")
        if reduction is not None:
            few = reduction.spectrum
            kept = few.shear_modulus > 0
            time, moduli = few.relaxation_time[kept], MEGA * few.shear_modulus[kept]
            lines.vlines(time, floor, moduli, color=COLOURS[3], linewidth=0.8)
            lines.plot(time, moduli, "D", color=COLOURS[3], markersize=4.0, label=f"reduced to {len(few)}")
        _draw_fit(curve, result, reference_temperature, measured)
        if reduction is not None:
            _draw_reduced(curve, result, reduction)
        for axes in (lines, curve):
            log_axis(axes, "x")
            log_axis(axes, "y")
        lines.set_ylim(floor, 1.5 * max(np.max(mu, initial=floor), equilibrium))
        for axes in (lines, curve):
            handles, _ = axes.get_legend_handles_labels()
            row_legend(axes, handles, 2, loc="upper center", bbox_to_anchor=(0.5, -0.2))
        letter((lines, curve))
    return figure


def _draw_fit(axes: Axes, result: SpectrumFit, reference_temperature: float | None, called: str) -> None:
    """Draw the measured curve and the model over reduced time or angular frequency."""
    abscissa, kind = result.reduced_abscissa, result.kind
    shown = spread(np.log10(abscissa), 80)
    factor = kind.label_factor
    names = ("storage", "loss") if len(kind.ordinates) > 1 else (called,)
    for index, (measured, name) in enumerate(zip(np.atleast_2d(result.measured), names, strict=True) if called else ()):
        axes.plot(
            abscissa[shown],
            factor * measured[shown],
            "os"[index],
            color="0.45",
            markerfacecolor="white",
            markersize=3.5,
            markeredgewidth=0.7,
            label=name,
        )
    # lines last, so that the legend names the measurements first
    for index, model in enumerate(np.atleast_2d(result.model)):
        axes.plot(abscissa, factor * model, "-", color=COLOURS[0], label=None if index else "discrete model")
    at = "" if reference_temperature is None else f" at {degrees(reference_temperature)}"
    reduced = "reduced " if called == "master curve" else ""
    axes.set(xlabel=f"{reduced}{kind.abscissa[0].replace('_', ' ')}{at} [{kind.abscissa[1]}]", ylabel=kind.label)


def _draw_reduced(axes: Axes, result: SpectrumFit, reduction: Reduction) -> None:
    """Draw the response of the reduced spectrum where it was compared with the full spectrum."""
    time, spectrum, equilibrium = result.reduced_time, reduction.spectrum, result.equilibrium_shear_modulus
    # G(t) falls, so that its moduli mark the reduced times of the comparison at all temperatures
    full = result.spectrum.relaxation_modulus(time, equilibrium)
    slack = 1 + 1e-9
    within = (full <= reduction.full.max() * slack) & (full >= reduction.full.min() / slack)
    if not within.any():
        return
    kind = result.kind
    model = kind.label_factor * 3.0**kind.stiffness_power * response(kind, spectrum, equilibrium, time[within])
    label = f"reduced to {len(spectrum)}, in its window"
    for index, channel in enumerate(model):
        abscissa = result.reduced_abscissa[within]
        axes.plot(abscissa, channel, "--", color=COLOURS[3], linewidth=1.6, label=None if index else label)
