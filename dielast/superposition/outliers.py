"""Single points far off the master curve: slips of the instrument, or of a hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dielast.errors import warn
from dielast.superposition.gather import Gathered
from dielast.superposition.masterfit import MasterFit

Array = NDArray[np.float64]
Index = NDArray[np.intp]

FAR = 8.0  # robust standard deviations,
FACTOR = 0.05  # and relative difference from its curve beyond which a point is named
ABOUT = 10  # points on either side that the scatter of a point is taken from, besides that of its whole curve
NAMED = 5


def warn_of_outliers(data: Gathered, imposed: Array, fit: MasterFit, channels: int) -> None:
    """Name points that lie off the smooth curves of a fit by far more than others of their curve, with the size.

    `imposed` (m,) is log10 b where it was prescribed; the first `channels` of the ordinates are what was fitted. What a point is
    off by is taken relative to the master curve, not in its logarithm, so that readings at a noise floor, which may fall to
    nothing, are none.
    """
    compliant, swept = data.measurement == "creep", data.measurement == "oscillation"
    log_time = np.log10(1 / data.abscissa if swept else data.abscissa) - fit.shift[data.curve]
    lift = (imposed + fit.vertical)[data.curve]
    found: list[tuple[float, str]] = []
    for spline, values, name in zip(fit.splines[:channels], data.ordinates, ("storage", "loss"), strict=False):
        expected = 10 ** ((spline(np.clip(log_time, spline.origin, spline.end)) - lift) * (-1 if compliant else 1))
        ratio = values / expected
        size = _far(data.curve, ratio)
        for k in np.flatnonzero(data.good & np.isfinite(size)):
            place = f"{data.abscissa[k]:.4g} rad/s ({name})" if swept else f"{data.abscissa[k]:.4g} s"
            said = f"{data.temperature[data.curve[k]]:g} degC at {place}, {size[k]:.3g} times what its curve leads to"
            found.append((float(abs(np.log(size[k]))), said))
    if not found:
        return
    worst = sorted(range(len(found)), key=lambda k: -found[k][0])[:NAMED]
    more = f"; and {len(found) - NAMED} more" if len(found) > NAMED else ""
    one = len(found) == 1
    warn(
        f"{'a point lies' if one else f'{len(found)} points lie'} far off the master curve: "
        f"{'; '.join(found[k][1] for k in sorted(worst))}{more}: {'it has' if one else 'they have'} next to no weight in the shift "
        f"factors, but {'is' if one else 'are'} still in the master curve: check {'it' if one else 'them'}, or leave "
        f"{'it' if one else 'them'} out"
    )


def _far(curve: Index, ratio: Array) -> Array:
    """How many times the middle of their curve points (n,) are that are far from it in terms of its scatter, and of that of their
    neighbours on it; NaN for the others.
    """
    far = np.full(ratio.size, np.nan)
    bounds = np.searchsorted(curve, np.arange(int(curve[-1]) + 2))
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        own = ratio[first:last]
        middle = float(np.median(own))
        away = np.abs(own / middle - 1)
        scatter = 1.4826 * float(np.median(away))
        for k in np.flatnonzero(away > max(FAR * scatter, FACTOR)):
            near = away[max(k - ABOUT, 0) : k + ABOUT + 1]
            if away[k] > FAR * 1.4826 * float(np.median(near)):
                far[first + k] = own[k] / middle
    return far
