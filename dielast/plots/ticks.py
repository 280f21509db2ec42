"""The ticks of axes, the numbers at them, what their labels say of these numbers, and strips beyond the times of an axis."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullFormatter

from dielast.plots.texts import number, power_of_ten

DIGIT = 0.636  # width of a digit over the size of the font, DejaVu Sans


def remainder(label: str, offset: float, power: int) -> str:
    """The `label` of an axis, the numbers at which are those of the quantity less an `offset` and in units of a `power` of ten."""
    name, bracket, unit = label.partition(" [")
    if offset:
        sign = "\N{MINUS SIGN}" if offset > 0 else "+"
        name += f" {sign} {number(abs(offset), 12)}"
    if power:
        unit = " ".join(filter(None, (power_of_ten(power), unit.rstrip("]"))))
    return f"{name} [{unit.rstrip(']')}]" if bracket or power else name


def clear_ticks(axes: Axes) -> bool:
    """Fewer ticks on a linear x axis whose numbers would run into each other; returns whether there are fewer now."""
    if not isinstance(axes.xaxis.get_major_locator(), MaxNLocator):
        return False
    low, high = axes.get_xlim()
    ticks = [tick for tick in axes.get_xticks() if low <= tick <= high]
    longest = max(map(len, axes.xaxis.get_major_formatter().format_ticks(ticks)), default=0)
    size = float(axes.xaxis.get_major_ticks(1)[0].label1.get_fontsize())  # points
    wide = (longest + 1) * DIGIT * size / 72  # inches
    across = axes.bbox.width / axes.figure.dpi
    apart = across * float(np.min(np.diff(ticks), initial=np.inf)) / (high - low)
    if apart < wide:
        axes.locator_params(axis="x", nbins=max(int(across / wide), 1))
    return apart < wide


def log_axis(axes: Axes, which: str) -> None:
    """A decimal log axis whose major ticks stay apart over many decades, with minor ticks if they fit."""
    scale, axis = (axes.set_xscale, axes.xaxis) if which == "x" else (axes.set_yscale, axes.yaxis)
    scale("log")
    low, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    decades = float(np.log10(high) - np.log10(low)) if low > 0 and high > low else 1.0
    if decades > 7:
        axis.set_major_locator(LogLocator(base=10 ** int(np.ceil(decades / 7)), numticks=20))
        axis.set_minor_locator(LogLocator(base=10, numticks=60))
    else:
        axis.set_minor_locator(LogLocator(base=10, subs=tuple(range(2, 10)), numticks=60))
    if decades >= 2:
        axis.set_minor_formatter(NullFormatter())
        # an empty label takes as long to place as a word
        axis.set_tick_params(which="minor", **{"labelbottom" if which == "x" else "labelleft": False})
        return

    def plain(value: float, _: float | None = None) -> str:
        first = f"{value:.12e}"[0]
        return number(value) if decades < 0.4 or first in ("12357" if decades < 0.8 else "125") else ""

    axis.set_major_formatter(plain)
    axis.set_minor_formatter(plain)


def limits(shown: tuple[float, float], above: float, below: float) -> tuple[float, float]:
    """The ends of a log axis of time with strips for films that live longer or fail at once; `above` and `below` are their shares
    of the height of the axes.
    """
    decades = np.log10(shown[1] / shown[0]) / (1 - above - below)
    return float(shown[0] * 10 ** (-decades * below)), float(shown[1] * 10 ** (decades * above))


def ticks_within(axes: Axes, shown: tuple[float, float]) -> None:
    """Remove ticks from the strips, which have no times."""
    for locate, ticks in (
        (axes.yaxis.set_major_locator, axes.get_yticks()),
        (axes.yaxis.set_minor_locator, axes.get_yticks(minor=True)),
    ):
        locate(FixedLocator([tick for tick in ticks if shown[0] <= tick <= shown[1]]))
