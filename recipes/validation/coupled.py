"""VHB 4905 pulled under 6 kV, predicted from the same pull without voltage."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from section import Section, picture, table
from vhb4905 import HANDLES, START, draw, read, summary

from dielast import VACUUM_PERMITTIVITY, Calibration, Free, Intervals, MeasuredTest, NoShift, Spectrum, calibrate
from dielast.plots.style import COLOURS, entry, grid, legend_below, sheet, style

THICKNESS = 0.5e-3  # m
PAIRS = ((701, 703), (702, 704))
"""Without and with voltage, at 23 and 50 degC, by the numbers of the file."""
REACHED = 3.0**2 + 2 / 3.0 - 3
"""I1 - 3 at the largest stretch, over which the limits of extension are stated."""
FREE_HERE = {
    "equilibrium.shear_modulus": Free(),
    "equilibrium.J_lim": Free(min=1.02 * REACHED, max=100 * REACHED, start=3 * REACHED),
    "nonequilibrium.shear_modulus": Free(),
    "nonequilibrium.relaxation_time": Free(),
    "nonequilibrium.J_lim": Free(min=0.05 * REACHED, max=100 * REACHED, start=3 * REACHED),
}
"""The limits of extension have wide bounds, as nothing else is known of them; branches flow before they lock."""
LIMIT = "equilibrium.J_lim"


def pulled(data: Path, number: int) -> MeasuredTest:
    """A curve up to stretch 3 at 0.2 /s, the voltage on the film from the start."""
    rows = read(data / "vhb4905" / "6-coupled.csv").query("id == @number")
    stretch = rows.stretch.to_numpy()
    at = np.cumsum(np.abs(np.diff(stretch, prepend=1.0))) / float(rows.vel.iloc[0])
    moved = np.diff(at, prepend=0.0) > 0
    field, celsius = float(rows.voltage.iloc[0]) / THICKNESS, round(float(rows.temp.iloc[0]) - 273.15, 2)
    name = f"{celsius:g} °C, {field * THICKNESS / 1e3:g} kV"
    return MeasuredTest(name, at[moved], stretch[moved], rows.stress.to_numpy()[moved], celsius, nominal_field=field)


def permittivity(data: Path, celsius: float) -> float:
    """What was measured at the lowest frequency, in F/m."""
    rows = read(data / "vhb4905" / "5-dielectric.csv")
    slow = rows.loc[rows.groupby("id").freq.idxmin()]
    return float(VACUUM_PERMITTIVITY * np.interp(celsius, slow.temp - 273.15, slow.dielec))


def coupled(data: Path) -> Section:
    """6 kV predicted at both temperatures."""
    rows, found = [], []
    for without, under in PAIRS:
        bare, charged = pulled(data, without), pulled(data, under)
        start = replace(
            START,
            spectrum=Spectrum([100.0, 3.0], [2e4, 4e4]),
            shift=NoShift(bare.temperature),
            permittivity=permittivity(data, bare.temperature),
        )
        result = calibrate([bare], start, FREE_HERE, validate=[charged], starts=4, intervals=Intervals(draws=60))
        found.append(result)
        for each in result.comparisons:
            numbers = ["pulls in", "", ""] if each.runaway is not None else summary([each])[1:]
            rows.append([each.test.name, "fitted" if each.fitted else "predicted", *numbers])
    drops = []
    for result in found:
        bare, charged = result.comparisons
        tops = [int(np.argmax(each.test.stretch)) for each in (bare, charged)]
        pairs = ((bare.test.measured, charged.test.measured), (bare.model, charged.model))
        taken = [1e-3 * (first[tops[0]] - second[tops[1]]) for first, second in pairs]
        foreseen = f", where {taken[1]:.1f} kPa are predicted" if np.isfinite(taken[1]) else ""
        drops.append(f"{taken[0]:.1f} kPa at {bare.test.temperature:g} °C{foreseen}")
    charged_lost = [each.test.name for result in found for each in result.comparisons if each.runaway is not None]
    squeezed = f" At {', '.join(charged_lost)} the predicted film pulls in, the measured one did not." if charged_lost else ""
    verdicts = " and ".join(f"{_verdict(result)} at {result.comparisons[0].test.temperature:g} °C" for result in found)
    limit = f"""Near pull-in a film is held by its limits of extension, and these pulls tell little of them: `{LIMIT}` is
{verdicts}. Both limits, that of the equilibrium spring and that of the branches, are free between
the bounds that `[springs] try` sets."""
    ran = [
        f"{100 * np.max(each.lost):.0f} % of the draws run away at {each.test.temperature:g} °C, and the band has no lower end "
        f"from stretch {each.opened:.2f} on"
        for result in found
        for each in result.comparisons
        if each.opened is not None
    ]
    away = f"""
A draw that runs away becomes wider than it is long and bears ever less, so that it counts as below every bound:
{"; ".join(ran)}. There, the band says that the film may run away, and what it bears at most."""
    text = f"""## VHB 4905 under 6 kV

The same laboratory pulled films of {1e3 * THICKNESS:g} mm to stretch 3 at 0.2 /s, with and without 6 kV between their faces. For
each temperature the curve without voltage is fitted, the permittivity is the one measured at the lowest frequency, and the curve
under voltage is predicted: nothing of it is fitted.

{table(["test", "used", "rms error", "R²", "within the 90 % band"], rows)}

At the largest stretch the voltage takes {", and ".join(drops)}.{squeezed}
{limit}{away if ran else ""}

{picture("coupled", "VHB 4905 pulled without and under 6 kV at two temperatures", "Black: 0 kV, fitted; blue: 6 kV, predicted.")}"""
    return Section(text, {"coupled": _figure(found)})


def _verdict(result: Calibration) -> str:
    """What a calibration says of the limit of extension."""
    place = result.fit.space.names.index(LIMIT)
    return {"lower bound": "a lower bound", "upper bound": "an upper bound"}.get(
        verdict := str(result.profiles[place].verdict), verdict
    )


def _figure(found: list[Calibration]) -> Figure:
    with style():
        figure = sheet("VHB 4905 pulled under 6 kV", 2, 2.6)
        for axes, result in zip(grid(figure, len(found), 2), found, strict=True):
            for each, colour, marker in zip(result.comparisons, (COLOURS[0], COLOURS[2]), "os", strict=True):
                draw(axes, each.test.stretch, each, colour, marker)
            highest = 1e-3 * max(each.test.measured.max() for each in result.comparisons)
            axes.set_ylim(-0.2 * highest, 1.5 * highest)
            axes.set_title(f"{result.comparisons[0].test.temperature:g} °C")
            axes.set_xlabel("stretch")
            axes.set_ylabel("nominal stress [kPa]")
        volts = [
            entry(name, color=COLOURS[k], marker=marker, markerfacecolor="white")
            for name, k, marker in (("0 kV", 0, "o"), ("6 kV", 2, "s"))
        ]
        legend_below(figure, [*volts, *HANDLES])
    return figure
