"""The figure of a calibration: every test with points, curve and band, the profiles of the parameters, and their correlations."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from scipy.interpolate import PchipInterpolator

from dielast.calibration.comparison import Comparison
from dielast.calibration.profiles import DECISIVE, Profile
from dielast.calibration.result import Calibration
from dielast.calibration.voltage import VoltageTest
from dielast.plots.style import ACROSS, COLOURS, SHADE, entry, grid, row_of, shade, sheet, spread, spread_indices, style
from dielast.plots.texts import axis_of, log_axis, number, shortened, typeset, unit_for

KILO = 1e-3  # from Pa
HIGHEST = 1.2  # height of a profile, as a multiple of the rise at which an end of the range is ruled out
MOST_TESTS, MOST_PROFILES = 12, 12
LONGEST = 20  # name of a test in the title of its panel
LEFT_OUT = "0.6"  # colour of points left out of the misfit
LEFT_TO_TIME = 0.2  # share of points at a held stretch above which a test is drawn over time
SYMBOLS = {
    "equilibrium.shear_modulus": r"$\mu_\mathrm{eq}$",
    "nonequilibrium.scale": "factor on branches",
    "nonequilibrium.shear_modulus": r"$\mu$ of branch",
    "nonequilibrium.relaxation_time": r"$\tau$ of branch",
}


def plot_calibration(calibration: Calibration, title: str | None = None) -> Figure:
    """Tests, profiles and correlations; an even selection if there are very many tests or parameters."""
    with style():
        every = calibration.comparisons
        tests = [every[k] for k in spread_indices(len(every), MOST_TESTS)]
        count = len(calibration.profiles)
        shown = spread_indices(count, MOST_PROFILES) if count else []
        across = row_of(len(tests))
        blocks = len(shown) + (len(shown) > 1)  # one parameter has no correlations
        heights = [1.75 * -(-len(tests) // across) + 0.35, 1.6 * -(-blocks // ACROSS)]
        figure = sheet(title, 2.1, sum(heights))
        parts = figure.subfigures(2, 1, height_ratios=heights, squeeze=False)[:, 0] if shown else [figure]
        _draw_tests(parts[0], calibration, tests, across)
        if shown:
            axes = grid(parts[1], blocks, ACROSS)
            for place, k in zip(axes, shown, strict=False):
                _draw_profile(place, calibration, k)
            if len(shown) > 1:
                _draw_correlations(axes[-1], calibration, shown)
    return figure


def _draw_tests(part: Figure | SubFigure, calibration: Calibration, tests: Sequence[Comparison], across: int) -> None:
    for place, comparison in zip(grid(part, len(tests), across), tests, strict=True):
        _draw_test(place, comparison)
    percent = f"{100 * calibration.level:g} % interval of measurements"
    handles = [
        entry(color="0.35", marker="o", linestyle="none", markerfacecolor="white", label="measured, fitted"),
        entry(color=COLOURS[1], marker="s", linestyle="none", markerfacecolor="white", label="measured, predicted only"),
        entry(color=COLOURS[0], label="model"),
        Patch(color=COLOURS[2], alpha=SHADE, label=percent),
    ]
    used = {comparison.fitted for comparison in tests}
    if len(used) == 1:
        handles.pop(1 if True in used else 0)
    if any(comparison.test.unused.size for comparison in tests):
        handles.append(entry(color=LEFT_OUT, marker="x", linestyle="none", label="measured, left out"))
    if len(tests) < len(calibration.comparisons):
        handles.append(entry(linestyle="none", label=f"{len(tests)} of {len(calibration.comparisons)} tests"))
    part.legend(handles=handles, loc="outside upper center", ncols=len(handles), fontsize=6.5)


def _draw_test(axes: Axes, comparison: Comparison) -> None:
    """Nominal stress over stretch, or over time if the test holds a stretch; voltage over stretch."""
    test = comparison.test
    x, over_time = test.time, True
    if isinstance(test, VoltageTest):
        x, over_time = test.stretch, False
    elif test.stretch is not None and np.ptp(test.stretch) > 0:
        still = np.abs(np.diff(test.stretch)) <= 1e-3 * float(np.ptp(test.stretch))
        over_time = bool(np.mean(still) > LEFT_TO_TIME)
        x = test.time if over_time else test.stretch
    called, factor = axis_of(test.header, [test.measured + test.rest])
    order = np.flatnonzero(x > 0) if over_time else np.arange(x.size)  # 0 s is nowhere on a logarithmic axis
    if isinstance(test, VoltageTest):
        order = np.argsort(x, kind="stable")
    ends = [factor * (bound + test.rest)[order] for bound in (comparison.lower, comparison.upper)]
    shade(axes, x[order], ends[0], ends[1], COLOURS[2])
    chosen = spread(test.place, 30) if x.size > 30 else order
    look = ("0.35", "o") if comparison.fitted else (COLOURS[1], "s")
    axes.plot(
        x[chosen],
        factor * (test.measured[chosen] + test.rest),
        look[1],
        color=look[0],
        markerfacecolor="white",
        markersize=2.6,
        mew=0.6,
    )
    time, stretch, values = test.unused
    axes.plot(time if over_time else stretch, factor * values, "x", color=LEFT_OUT, markersize=2.4, mew=0.6)
    axes.plot(x[order], factor * (comparison.model + test.rest)[order], "-", color=COLOURS[0], linewidth=1.0)
    across = test.measure.replace("_", " ") if isinstance(test, VoltageTest) else "stretch"
    axes.set(xlabel="time [s]" if over_time else across, ylabel=called if " [" in called else f"{called} [1]")
    if over_time:
        log_axis(axes, "x")
    name = shortened(test.name, LONGEST)
    error = 100 * comparison.rms_relative_error
    missed = f"{error:.0f}" if error >= 100 else number(error, 2)
    axes.set_title(typeset(f"{name}, {test.temperature:.4g} degC: {missed} %"), fontsize=6.5, loc="left", parse_math=False)
    seen = factor * (np.concatenate((test.measured, comparison.model)) + test.rest)
    least, most = float(np.nanmin(seen)), float(np.nanmax(seen))
    low, high = axes.get_ylim()  # the axes end at the points and the curve: a band may leave them
    low, high = max(low, least - (most - least)), min(high, most + (most - least))
    # and near the points where the curve runs away from them
    measured = factor * (test.measured + test.rest)
    room = float(np.ptp(measured))
    if least < measured.min() - room or most > measured.max() + room:
        low, high = max(low, float(measured.min()) - room), min(high, float(measured.max()) + room)
    axes.set_ylim(min(0.0, low) if test.rest == 0 else low, high)


def _draw_profile(axes: Axes, calibration: Calibration, k: int) -> None:
    """The rise of the sum of squares about the fit, with the ends of the interval."""
    parameter, profile = calibration.fit.space.parameters[k], calibration.profiles[k]
    levels = (calibration.level, DECISIVE)
    thresholds = [float(calibration.likelihood.thresholds(level)[k]) for level in levels]
    top = HIGHEST * thresholds[-1]
    near = _window(profile, top)
    values = parameter.value(profile.coordinate[near])
    most = float(np.max(np.abs(values)))
    small = parameter.unit == "Pa" and most < 1 / KILO  # such as Yeoh's C20
    unit, factor = ("Pa", 1.0) if small else unit_for(parameter.unit, most)
    x, y = factor * values, profile.rise[near]
    # smooth and monotone in the root of the rise, which changes sign at the fit
    fine = np.unique(
        np.append(profile.coordinate[near], np.linspace(profile.coordinate[near[0]], profile.coordinate[near[-1]], 200))
    )
    fit = float(calibration.fit.coordinates[k])
    root = np.sqrt(np.clip(y, 0.0, 1e6)) * np.sign(profile.coordinate[near] - fit)
    between = PchipInterpolator(profile.coordinate[near], root)(fine)
    axes.plot(factor * parameter.value(fine), np.square(between), "-", color=COLOURS[0], linewidth=0.9)
    axes.plot(x, y, "o", color=COLOURS[0], markersize=2.2)
    for level, threshold, dashes in zip(levels, thresholds, ("--", ":"), strict=True):
        axes.axhline(threshold, color=COLOURS[1], linestyle=dashes, linewidth=0.8)
        at_edge = axes.get_yaxis_transform()  # x in shares of the axes
        axes.text(1.02, threshold, f"{100 * level:g} %", transform=at_edge, ha="left", va="center", fontsize=5)
    for end in (profile.lower, profile.upper):
        if np.isfinite(end):
            axes.axvline(factor * float(parameter.value(end)), color="0.6", linewidth=0.7)
    axes.set_xlabel(f"{_symbol(parameter.name)}" + ("" if unit == "1" else f" [{unit}]"), fontsize=6.5)
    axes.set_ylabel("rise of $\\chi^2$", fontsize=6.5)
    if parameter.scale is None and x.max() > 5 * x.min():
        log_axis(axes, "x", narrow=True)
    else:
        axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.set_ylim(0, top)
    axes.set_title(str(profile.verdict), fontsize=6.5, loc="left")


def _window(profile: Profile, top: float) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """The points of a profile, on either side up to the first point above the `top` of the axes."""
    best = int(np.argmin(profile.rise))
    high = np.flatnonzero(profile.rise > top)
    first = max((int(k) for k in high if k < best), default=0)
    last = min((int(k) for k in high if k > best), default=profile.rise.size - 1)
    return np.arange(first, last + 1)


def _draw_correlations(axes: Axes, calibration: Calibration, shown: Sequence[int]) -> None:
    columns = calibration.correlation_columns()[1:]
    matrix = np.array([np.asarray(column.values, dtype=float) for column in columns])[np.ix_(shown, shown)]
    image = axes.imshow(matrix, vmin=-1, vmax=1, cmap="PuOr", aspect="auto")
    names = [_symbol(calibration.fit.space.names[k]) for k in shown]
    ticks = np.arange(len(shown))
    axes.set_xticks(ticks, names, rotation=90, fontsize=5.5)
    axes.set_yticks(ticks, names, fontsize=5.5)
    axes.tick_params(which="both", length=0)
    axes.minorticks_off()
    for (row, column), value in np.ndenumerate(matrix):
        if row != column and np.isfinite(value) and len(shown) <= 8:
            axes.text(
                column, row, typeset(f"{value:z.1f}"), ha="center", va="center", fontsize=5, color="k" if abs(value) < 0.7 else "w"
            )
    axes.set_title("correlations", fontsize=6.5, loc="left")
    axes.figure.colorbar(image, ax=axes, shrink=0.9)


def _symbol(name: str) -> str:
    """The label of a parameter."""
    path, _, index = name.partition("[")
    text = SYMBOLS.get(path)
    if text is not None:
        return text + (f" {index[:-1]}" if index else "")
    test, _, key = name.rpartition(": ")
    if test:
        return f"{test}: {key.replace('_', ' ')}"
    section, _, key = path.partition(".")
    whose = {"equilibrium": "eq.", "nonequilibrium": "branches"}.get(section, section)
    return f"{key.replace('_', ' ')} ({whose})" + (f" {index[:-1]}" if index else "")
