"""VHB 4905 of another laboratory: half of its tests fitted, the other half predicted, and what the material is not made for."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from section import Section, picture, table

from dielast import WLF, Calibration, Comparison, Free, Gent, Intervals, Material, MeasuredTest, Spectrum, calibrate
from dielast.plots.style import COLOURS, MARKERS, SHADE, grid, legend_below, shade, sheet, spread, style
from dielast.plots.texts import typeset

START = Material(
    "VHB 4905", 20e3, Spectrum([300.0, 10.0, 0.3, 0.01], [1e4, 3e4, 1e5, 1e6]), WLF(20.0, 13.0, 187.0), Gent(110.0), Gent(55.0)
)
FREE = {
    "equilibrium.shear_modulus": Free(),
    "equilibrium.J_lim": Free(min=14, max=1e4),
    "nonequilibrium.J_lim": Free(min=14, max=1e4),
    "nonequilibrium.shear_modulus": Free(),
    "nonequilibrium.relaxation_time": Free(),
    "shift.C1": Free(min=2, max=40),
    "shift.C2": Free(min=50, max=500),
}
NUMBERS = tuple(range(100, 128))
"""Loading and unloading up to stretch 4, -20 to 80 degC, 0.03 to 0.1 /s, by the numbers of the file."""
FITTED, PREDICTED = NUMBERS[::2], NUMBERS[1::2]
FAR = (128, 129, 130)
"""Loading to stretch 9, at 20 degC."""


@cache
def read(path: Path) -> pd.DataFrame:
    """A file of the set: semicolons, decimal commas."""
    return pd.read_csv(path, sep=";", decimal=",", encoding="latin-1")


def loading(data: Path, number: int) -> MeasuredTest:
    """A loading-unloading curve; its times follow from its rate."""
    rows = read(data / "vhb4905" / "4-loading.csv").query("id == @number")
    stretch, rate, kelvin = rows.stretch.to_numpy(), float(rows.vel.iloc[0]), float(rows.temp.iloc[0])
    at = np.cumsum(np.abs(np.diff(stretch, prepend=1.0))) / rate
    moved = np.diff(at, prepend=0.0) > 0
    celsius = round(kelvin - 273.15, 2)
    name = f"{celsius:g} °C, {rate:g} /s, to {stretch.max():.1f}"
    return MeasuredTest(name, at[moved], stretch[moved], rows.stress.to_numpy()[moved], celsius)


def holds(data: Path) -> list[MeasuredTest]:
    """Relaxation at 20 degC from 15 min on, at a stretch that was reached before: at once, as far as such times can tell."""
    found = []
    for _, rows in read(data / "vhb4905" / "3-creep.csv").groupby("id"):
        at, stress, top = rows.time.to_numpy(), rows.stress.to_numpy(), float(rows.stretch.iloc[0])
        stretch = np.full(at.size + 1, top)
        found.append(MeasuredTest(f"held at {top:g}", np.append(0.0, at), stretch, np.append(0.0, stress), 20.0))
    return found


@cache
def calibrated(data: Path) -> Calibration:
    """Every second curve fitted, all else predicted."""
    others = [*(loading(data, number) for number in (*PREDICTED, *FAR)), *holds(data)]
    return calibrate(
        [loading(data, number) for number in FITTED], START, FREE, validate=others, starts=2, intervals=Intervals(draws=60)
    )


def parts(data: Path) -> tuple[list[Comparison], list[Comparison], list[Comparison], list[Comparison]]:
    """The tests beside the model: fitted, predicted, to stretch 9, held."""
    every = list(calibrated(data).comparisons)
    ends = np.cumsum([len(FITTED), len(PREDICTED), len(FAR)])
    fitted, predicted, far, held = (list(part) for part in np.split(np.array(every, dtype=object), ends))
    return fitted, predicted, far, held


def relative_error(tests: Sequence[Comparison]) -> float:
    """The rms error over all points, relative to the rms of what was measured."""
    miss = np.concatenate([each.model - each.test.measured for each in tests])
    return float(np.sqrt(np.mean(miss**2) / np.mean(np.concatenate([each.test.measured for each in tests]) ** 2)))


def summary(tests: Sequence[Comparison]) -> list[str]:
    """Relative rms error over all points, explained share of the variance, and the share of points within the 90 % band."""
    model = np.concatenate([each.model for each in tests])
    measured = np.concatenate([each.test.measured for each in tests])
    inside = np.concatenate([(each.test.measured >= each.lower) & (each.test.measured <= each.upper) for each in tests])
    explained = 1 - np.mean((model - measured) ** 2) / np.var(measured)
    return [f"{len(tests)}", f"{100 * relative_error(tests):.1f} %", f"{explained:.3f}", f"{100 * np.mean(inside):.0f} %"]


def halves(data: Path) -> Section:
    """Half of the loading curves fitted, half predicted; then what lies outside what was fitted."""
    fitted, predicted, far, held = parts(data)
    result = calibrated(data)
    groups = {
        "fitted: every second curve, stretch to 4, -20 to 80 °C": fitted,
        "predicted: the other half": predicted,
        "predicted: 20 °C, stretch to 9": far,
        "predicted: 20 °C, held for 15 min to 3 h": held,
    }
    values = {column.name: column.values for column in result.columns()}
    rows = [
        [f"`{name}`", *(_number(values[key][k]) for key in ("value", "lower", "upper")), str(values["unit"][k]), str(verdict)]
        for k, (name, verdict) in enumerate(zip(values["parameter"], values["verdict"], strict=True))
    ]
    by_temperature = []
    for temperature in sorted({each.test.temperature for each in predicted}):
        at = [each for each in predicted if each.test.temperature == temperature]
        by_temperature.append([f"{temperature:g}", *summary(at)])
    ends = [float(each.test.time[-1]) for each in (*fitted, *predicted)]
    lost = sorted(1 - each.test.measured[-1] / each.test.measured[0] for each in held)
    steepest = max(far, key=lambda each: each.test.measured.max())
    top = steepest.test.measured.max(), steepest.model[int(np.argmax(steepest.test.measured))]
    groups_of = [[each for each in predicted if low <= each.test.temperature <= high] for low, high in ((-21, -19), (19, 61))]
    cold = [100 * relative_error(each) for each in groups_of]
    loose = [f"`{name}`" for name, verdict in result.verdicts.items() if verdict != "determined"]
    lasting = f"{min(ends):.0f} to {max(ends):.0f} s"
    further = f"{100 * lost[0]:.0f} to {100 * lost[-1]:.0f}"
    slowest = max(result.material.spectrum.relaxation_time)
    header = ["number", "rms error", "R²", "within the 90 % band"]
    text = f"""## VHB 4905 of another laboratory: fitted on half, predicted on half

Loading and unloading of 3M VHB 4905, 0.5 mm, {len(NUMBERS)} curves (Liao, Mokarram, Hossain et al., DOI
10.1016/j.ijnonlinmec.2019.103263; digitised files of HyperCalibration.jl). Every second one is fitted, by one material with one
shift law: an equilibrium spring, four branches, springs of Gent. The same material predicts all other curves.

{table(["tests", *header], [[name, *summary(group)] for name, group in groups.items()])}

The predicted half, by temperature:

{table(["°C", *header], by_temperature)}

{picture("halves", *HALVES)}

{table(["constant", "value", "from", "to", "unit", "verdict"], rows)}

**What fails, and why.**

- *Held for 15 min to 3 h.* The fitted tests last {lasting}, and their slowest branch relaxes in {slowest:.0f} s: the predicted \
stress is level where the tape loses another {further} %. A relaxation test belongs into the fit of whoever asks for hours.
- *To stretch 9.* At the largest stretch the tape bears {1e-3 * top[0]:.0f} kPa, and {1e-3 * top[1]:.0f} kPa are predicted: \
stretches to 4 do not tell where springs stiffen. `calibrate` writes the range of its tests into the material; a simulation beyond \
it warns.
- *-20 °C.* The error of the predicted curves is {cold[0]:.0f} % there, and {cold[1]:.0f} % from 20 to 60 °C. One limit of \
extension serves all branches at all temperatures; and known by a bound only, or not at all, are {", ".join(loose)}.

{picture("beyond", *BEYOND)}"""
    return Section(text, {"halves": _figure_of_halves(predicted), "beyond": _figure_beyond(held, far)})


def _number(value: object) -> str:
    number = float(str(value))
    return f"{number:.3g}" if np.isfinite(number) else ""


def draw(axes: Axes, x: np.ndarray, comparison: Comparison, colour: str, marker: str) -> None:
    shown = np.sort(spread(np.arange(x.size, dtype=float), 30))
    shade(axes, x, 1e-3 * comparison.lower, 1e-3 * comparison.upper, colour)
    axes.plot(x, 1e-3 * comparison.model, "-", color=colour)
    axes.plot(x[shown], 1e-3 * comparison.test.measured[shown], marker, color=colour, markerfacecolor="white")


HALVES = (
    "Loading and unloading curves of VHB 4905 at six temperatures, none of them fitted, with predictions and bands",
    "One predicted curve for each temperature; shaded: where 90 % of measured points should lie.",
)
BEYOND = (
    "VHB 4905 held at four stretches and pulled to stretch 9, predicted from short loading tests",
    "Outside what was fitted: left held at the stretch beside each line, right pulled to stretch 9 at three rates, both at 20 °C.",
)
HANDLES = [
    Line2D([], [], color="0.2", marker="o", markerfacecolor="white", linestyle="none", label="measured"),
    Line2D([], [], color="0.2", label="predicted"),
    Patch(color="0.2", alpha=SHADE, linewidth=0, label="90 % of what is measured"),
]


def _figure_of_halves(predicted: Sequence[Comparison]) -> Figure:
    shown = {}
    for each in sorted(predicted, key=lambda each: each.test.stretch.max()):
        shown[each.test.temperature] = each  # the one of the largest stretch
    with style():
        figure = sheet("VHB 4905 of another laboratory: predicted, none of these curves was fitted", 2, 3.8)
        for axes, (_, each) in zip(grid(figure, len(shown), 3), sorted(shown.items()), strict=True):
            draw(axes, each.test.stretch, each, COLOURS[2], "o")
            axes.set_title(typeset(each.test.name))
            axes.set_xlabel("stretch")
            axes.set_ylabel("nominal stress [kPa]")
        legend_below(figure, HANDLES)
    return figure


def _figure_beyond(held: Sequence[Comparison], far: Sequence[Comparison]) -> Figure:
    with style():
        figure = sheet("VHB 4905 beyond what was fitted, 20 °C", 2, 2.7)
        left, right = grid(figure, 2, 2)
        for each, colour, marker in zip(held, COLOURS, MARKERS, strict=False):
            hours = each.test.time / 3600
            draw(left, hours, each, colour, marker)
            name = each.test.name.removeprefix("held at ")
            left.annotate(name, (hours[-1], 1e-3 * each.model[-1]), (4, -2), textcoords="offset points", fontsize=7)
        for each, colour, marker in zip(far, COLOURS, MARKERS, strict=False):
            draw(right, each.test.stretch, each, colour, marker)
        left.set_xlim(0, 3.7)
        left.set_ylim(0)
        left.set_xlabel("time [h]")
        right.set_xlabel("stretch")
        for axes in (left, right):
            axes.set_ylabel("nominal stress [kPa]")
        legend_below(figure, HANDLES)
    return figure
