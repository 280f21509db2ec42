"""Strips above and below a log axis of time, for films that live longer, fail at once or do not reach the goal."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator


def limits(shown: tuple[float, float], above: float, below: float) -> tuple[float, float]:
    """The ends of a log axis with strips beyond its times; `above` and `below` are shares of the height of the axes."""
    decades = np.log10(shown[1] / shown[0]) / (1 - above - below)
    return float(shown[0] * 10 ** (-decades * below)), float(shown[1] * 10 ** (decades * above))


def ticks_within(axes: Axes, shown: tuple[float, float]) -> None:
    """Remove ticks from the strips, which have no times."""
    for locate, ticks in (
        (axes.yaxis.set_major_locator, axes.get_yticks()),
        (axes.yaxis.set_minor_locator, axes.get_yticks(minor=True)),
    ):
        locate(FixedLocator([tick for tick in ticks if shown[0] <= tick <= shown[1]]))
