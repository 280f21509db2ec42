"""Strips above and below the times of a log axis, for what has no time on it: what lives longer, fails at once, or nowhere is."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator


def limits(shown: tuple[float, float], above: float, below: float) -> tuple[float, float]:
    """The ends of a log axis with strips beyond the times shown, which take so much of its height above and below."""
    decades = np.log10(shown[1] / shown[0]) / (1 - above - below)
    return float(shown[0] * 10 ** (-decades * below)), float(shown[1] * 10 ** (decades * above))


def ticks_within(axes: Axes, shown: tuple[float, float]) -> None:
    """Leave only the ticks of the times shown: there are no times in the strips."""
    for locate, ticks in (
        (axes.yaxis.set_major_locator, axes.get_yticks()),
        (axes.yaxis.set_minor_locator, axes.get_yticks(minor=True)),
    ):
        locate(FixedLocator([tick for tick in ticks if shown[0] <= tick <= shown[1]]))
