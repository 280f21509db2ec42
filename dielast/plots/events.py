"""Curves of cases, with their bands and events, and bars for the intervals of the events."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from dielast.mechanics.criteria import named, names
from dielast.plots.looks import Arrangement
from dielast.plots.style import SHADE, entry

BAR = 0.8  # line width of the bar through an event
TIP = 3.0  # points, between the end of the axes and the middle of a marker at it
LEAST_SEEN = 0.02  # share of the height of the axes: a narrower band is hidden by its line

Span = tuple[float, float]
Band = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class Mark:
    """An event at `x` and `y` in SI, with lower and upper bounds of x, the upper one infinite if it may never happen."""

    name: str
    x: float
    y: float
    span: Span | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A case: `x` and `y` (rows,) in SI and a `band`, which are x and the lower and upper bounds of y, open where the upper one is
    infinite. From the row `failed` on, at which the case failed, its line is dimmed.
    """

    label: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    band: Band | None = None
    marks: Sequence[Mark] = ()
    failed: int | None = None


@dataclass(frozen=True, slots=True)
class View:
    """The axes of all panels: factors into the units shown, and which axes are logarithmic."""

    factors: tuple[float, float]
    log: tuple[bool, bool]

    def seen(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points can be drawn on the axes."""
        return np.isfinite(x) & np.isfinite(y) & ((x > 0) | (not self.log[0])) & ((y > 0) | (not self.log[1]))


def draw_bands(panels: Sequence[Axes], arranged: Arrangement, view: View, curves: Sequence[Curve]) -> str | None:
    """Draw the bands; returns the text that the legend adds to their name, or None if no band is visible."""
    seen = opened = False
    place = np.log10 if view.log[1] else np.asarray
    for axes, panel in zip(panels, arranged.panels, strict=True):
        for case in panel.cases:
            band, look = curves[case].band, arranged.looks[case]
            if band is None:
                continue
            along, low, high = band
            known = view.seen(along, low)
            within = known & np.isfinite(high)
            across, down, up = along * view.factors[0], low * view.factors[1], high * view.factors[1]
            filled: Any = {"color": look["color"], "alpha": SHADE, "linewidth": 0.0}
            axes.fill_between(across, down, np.where(within, up, np.nan), where=within, **filled)
            axes.update_datalim(np.column_stack([across[within], up[within]]))
            width = float(np.max(place(up[within]) - place(down[within]), initial=0.0))
            seen |= width >= LEAST_SEEN * float(np.ptp(place(axes.dataLim.intervaly)))
            for last in np.flatnonzero(within[:-1] & known[1:] & np.isposinf(high[1:])):
                # from here on the band has no upper end
                opened = True
                where = axes.transData + ScaledTranslation(0, TIP / 72, axes.figure.dpi_scale_trans)
                axes.plot(
                    [across[last]], [up[last]], marker=r"$\uparrow$", markersize=5.0, markeredgewidth=0.2, transform=where,
                    linestyle="none", color=look["color"],
                )  # fmt: skip
    if not seen:
        return None
    return " (\N{UPWARDS ARROW} open: too many films have failed)" if opened else ""


def draw_marks(panels: Sequence[Axes], arranged: Arrangement, view: View, curves: Sequence[Curve]) -> dict[str, bool]:
    """Draw the events; returns, by name in the order of the legend, whether an interval is visible as a bar."""
    happened: dict[str, bool] = {}
    of_case = {case: axes for axes, panel in zip(panels, arranged.panels, strict=True) for case in panel.cases}
    drawn = [(of_case[case], arranged.looks[case]["color"], mark) for case in sorted(of_case) for mark in curves[case].marks]
    for axes, colour, mark in drawn:
        axes.plot(mark.x * view.factors[0], mark.y * view.factors[1], linestyle="none", **_event_look(mark.name, colour))
        happened.setdefault(mark.name, False)
    for axes, colour, mark in drawn:
        if mark.span is not None and np.isfinite(mark.span[0]):
            happened[mark.name] |= _span(axes, mark.span, view.factors[0], mark.y * view.factors[1], colour, view.log[0])
    return {name: happened[name] for name in names() if name in happened}


def _event_look(name: str, colour: Any) -> dict[str, Any]:
    """The marker of an event."""
    return {
        "marker": named(name).marker,
        "color": colour,
        "markersize": 5.5,
        "markerfacecolor": "none",
        "markeredgewidth": 1.1,
        "zorder": 4,
    }


def event_handle(name: str, bar: bool, alone: bool, arranged: Arrangement) -> Artist:
    """The legend entry for events of a `name`, with a `bar` if one is visible; in the colour of the case if that is `alone`."""
    look = _event_look(name, arranged.looks[0]["color"] if alone else "black")
    return entry(linestyle="-" if bar else "none", linewidth=BAR, label=name, **look)


def _span(axes: Axes, span: Span, factor: float, up: float, colour: Any, logarithmic: bool) -> bool:
    """Draw a bar from the lower to the upper x of a mark, with a tip at the end of the axes if it continues beyond them.

    Returns whether the bar is visible beside the mark.
    """
    low, high = (end * factor for end in span)
    left, right = axes.get_xlim()
    if logarithmic and low <= 0:
        low = axes.dataLim.minposx
    look: Any = {"color": colour, "linewidth": BAR, "markersize": 4.0, "zorder": 3.5}
    open_end = not np.isfinite(high)
    axes.plot([low, max(low, right) if open_end else high], [up, up], marker="|", markevery=[0] if open_end else [0, 1], **look)
    if open_end:
        axes.set_xlim(left if not logarithmic else None, max(low, right))
        within = axes.transData + ScaledTranslation(-TIP / 72, 0, axes.figure.dpi_scale_trans)
        axes.plot([max(low, right)], [up], marker=">", transform=within, **look)
        return True
    ends = axes.dataLim.intervalx
    if logarithmic:
        return bool(np.log10(high / low) >= 2 * LEAST_SEEN * np.log10(ends[1] / axes.dataLim.minposx))
    return bool(high - low >= 2 * LEAST_SEEN * np.ptp(ends))
