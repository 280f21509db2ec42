"""The figure of measured failures: a probability plot with band and survivors, and times to failure over voltage."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from dielast.calibration.failures.fits import FailureFit, Lives
from dielast.calibration.failures.likelihood import Seen
from dielast.calibration.failures.specimens import Simulated
from dielast.plots.style import COLOURS, SHADE, entry, letter, open_marker, panels, row_legend, shade, style
from dielast.plots.texts import log_axis

DASHES = ("-", "--", "-.", ":")
WITHOUT: Any = {"color": "0.25", "linestyle": (0, (1, 1.5)), "linewidth": 1.0}
PERCENT = (0.1, 1, 5, 10, 25, 50, 75, 90, 99, 99.9)


def plot_failures(
    tested: Simulated, fitted: Sequence[FailureFit], lives: Lives, title: str | None = None, line: NDArray[np.float64] | None = None
) -> Figure:
    """The share of failed specimens over their exposure, and their times over the voltage with the predicted lives; a `line`
    (films,) has the times in s within which half of the films fail by a power law of the voltage.
    """
    with style():
        figure, (left, right) = panels(2, title)
        for axes, handles in ((left, _probability(left, fitted)), (right, _lives(right, tested, lives, line))):
            row_legend(axes, handles, 2, loc="upper center", bbox_to_anchor=(0.5, -0.2), fontsize=6.5)
        letter((left, right))
    return figure


def _dashes(number: int) -> str:
    return DASHES[number % len(DASHES)]


def _scale(share: NDArray[np.float64], law: FailureFit) -> NDArray[np.float64]:
    """The quantile on which the shares of the scatter law are a straight line over its exposure."""
    return law.law.model.scatter.standard.quantile(np.clip(share, 1e-12, 1 - 1e-12))


def _probability(axes: Axes, fitted: Sequence[FailureFit]) -> list[Line2D | Patch]:
    """Failures at their ranks over the exposure in units of that typical of the material, survivors below."""
    handles: list[Line2D | Patch] = []
    lowest = highest = 0.0
    for number, law in enumerate(fitted):
        colour = COLOURS[(2, 1, 4, 3)[number % 4]]
        standing, ranks = law.standing(), law.ranks()
        seen, scatter = law.law.model.observations.seen, law.law.model.scatter
        failed = np.isfinite(ranks) & np.isfinite(standing)
        called = f" ({law.mode})" if law.mode else ""
        if failed.any():
            place = _scale(ranks[failed], law)
            lowest, highest = min(lowest, float(place.min())), max(highest, float(place.max()))
            points = open_marker(number, colour) | {"linestyle": "none", "zorder": 3}
            handles += axes.plot(np.exp(standing[failed]), place, label=f"failed{called}", **points)
        alive = standing[(seen == Seen.SUSPENDED) & np.isfinite(standing)]
        if number == 0 and alive.size:
            points = {"marker": "|", "linestyle": "none", "color": "0.3", "markersize": 6, "label": "suspended"}
            handles += axes.plot(np.exp(alive), np.full(alive.size, 0.03), transform=axes.get_xaxis_transform(), **points)
        share = np.linspace(-6.5, 2.0, 60) if scatter.scales_with_area else np.linspace(-3.2, 3.2, 60)
        k = law.fit.at[-1]
        v = np.log1p(np.maximum(np.exp(k) * share, -0.999)) if scatter.linear else np.exp(k) * share
        handles += axes.plot(np.exp(v), share, color=colour, linestyle=_dashes(number), zorder=2, label=f"{law.name}{called}")
        if law.fit.free.size:
            # the same films under the laws of the draws, by the mean shift of all specimens
            drawn = law.draws[:200]
            moved = np.median(law.law.model.places(drawn)[0] - law.law.model.places(law.fit.at[None])[0], axis=1)
            w = np.array([scatter.place(v + shift, at[-1:], np.zeros(1))[0] for shift, at in zip(moved, drawn, strict=True)])
            low_band, high_band = law.bounds(w)
            shade(axes, np.exp(v), low_band, high_band, colour)
            handles.append(Patch(color=colour, alpha=SHADE, label=f"{100 * law.level:g} % interval{called}"))
    law = fitted[0]
    percent = np.array(PERCENT) / 100
    ticks = _scale(percent, law)
    shown = (ticks > lowest - 1.2) & (ticks < max(highest, 1.0) + 0.5)
    axes.set_ylim(lowest - 1.0, max(highest, 0.6) + 0.5)
    axes.set_yticks(ticks[shown], [f"{100 * value:g}" for value in percent[shown]])
    axes.minorticks_off()
    law_of = "damage" if law.law.is_damage else "field over breakdown field"
    axes.set(xlabel=f"{law_of} [1]", ylabel="failed [%]")
    log_axis(axes, "x")
    everything = np.concatenate([np.exp(one.standing()[np.isfinite(one.standing())]) for one in fitted])
    before, after = (0.7, 1.8) if law.law.is_damage else (0.95, 1.06)
    axes.set_xlim(before * float(everything.min()), after * float(everything.max()))
    return handles


def _lives(axes: Axes, tested: Simulated, lives: Lives, without: NDArray[np.float64] | None) -> list[Line2D | Patch]:
    """Times to failure over voltage: measured, and the band between the first and the last share of films that fail."""
    specimens = tested.specimens
    pairs = sorted(set(map(tuple, lives.prestretch.tolist())))
    handles: list[Line2D | Patch] = []
    middle = int(np.argmin(np.abs(np.array(lives.shares) - 0.5)))
    low = int(np.argmin(np.abs(np.array(lives.shares) - 0.1)))
    for number, pair in enumerate(pairs):
        colour = COLOURS[(2, 1, 4, 3, 5, 6)[number % 6]]
        name = f"prestretch {pair[0]:g}" + ("" if pair[0] == pair[1] else f" x {pair[1]:g}")
        here = np.all(lives.prestretch == pair, axis=1)
        volt = lives.voltage[here] / 1e3
        order = np.argsort(volt)
        line = lives.time[middle, here][order]
        known = np.isfinite(line) & (line > 0)
        axes.plot(volt[order][known], line[known], color=colour, linestyle=_dashes(number))
        if without is not None:
            axes.plot(volt[order], without[here][order], **WITHOUT)
        first, last = (lives.time[k, here][order] for k in (low, -1))
        filled = np.isfinite(first) & np.isfinite(last) & (first > 0)
        if filled.any():
            shade(axes, volt[order][filled], first[filled], last[filled], colour)
        mine = np.all(np.isclose(specimens.prestretch, pair), axis=1) & (tested.end > 0)
        failed = mine & (tested.seen != Seen.SUSPENDED)
        alive = mine & (tested.seen == Seen.SUSPENDED)
        look = open_marker(number, colour) | {"linestyle": "none", "zorder": 3}
        axes.plot(tested.voltage[failed] / 1e3, tested.end[failed], **look)
        axes.plot(tested.voltage[alive] / 1e3, tested.end[alive], **look | {"markersize": 2.0, "markerfacecolor": colour})
        for volts, end in zip(tested.voltage[alive][:200] / 1e3, tested.end[alive], strict=False):
            axes.annotate("", (volts, end * 1.6), (volts, end), arrowprops={"arrowstyle": "->", "color": colour, "lw": 0.6})
        handles.append(entry(f"{name}: measured, B50", **look | {"linestyle": _dashes(number)}))
    if np.any(tested.seen == Seen.SUSPENDED):
        handles.append(entry("suspended", marker=r"$\uparrow$", markersize=6, color="0.4", linestyle="none"))
    band = COLOURS[2] if len(pairs) == 1 else "0.4"
    handles.append(Patch(color=band, alpha=SHADE, label=f"B{100 * lives.shares[low]:g} to B{100 * lives.shares[-1]:g}"))
    if without is not None and np.any(np.isfinite(without)):
        handles.append(entry("power law: B50", **WITHOUT))
    axes.set(xlabel="voltage [kV]", ylabel="time to failure [s]")
    log_axis(axes, "y")
    return handles
