"""Single points far off the master curve: slips of the instrument, or of a hand."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from dielast.errors import warn
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.superposition.gather import Gathered
from dielast.superposition.joint_fit import MasterFit

FAR = 8.0  # robust standard deviations,
FACTOR = 0.05  # and relative difference from its curve beyond which a point is named
NEIGHBOURHOOD = 10  # points on either side that the scatter of a point is taken from, besides that of its whole curve
NAMED = 5


def warn_of_outliers(data: Gathered, imposed: Floats, fit: MasterFit, channels: int) -> Flags:
    """Name points that lie off the smooth curves of a fit by far more than others of their curve; returns which (c, n).

    `imposed` (m,) is log10 b where it was prescribed; the first `channels` of the ordinates are what was fitted. The distance of
    a point is taken relative to the master curve, not in its logarithm, so that readings at a noise floor, which may fall to zero,
    are no outliers.
    """
    size = np.full(data.ordinates.shape, np.nan)
    log_time = data.log_time - fit.shift[data.curve]
    lift = (imposed + fit.vertical)[data.curve]
    for channel, spline in enumerate(fit.splines[:channels]):
        log_modulus = spline(np.clip(log_time, spline.origin, spline.end)) - lift
        size[channel] = _far(data.curve, data.ordinates[channel] / 10 ** (data.kind.stiffness_power * log_modulus))
    far = np.isfinite(size) & data.good
    if np.any(far):
        _warn(data, size, np.argwhere(far))
    return np.asarray(far)


def _warn(data: Gathered, size: Floats, far: Index) -> None:
    """Name the worst of the points with the places `far` (k, 2) among channels and points, in their order."""
    unit, named = data.kind.abscissa[1], []
    worst = np.sort(np.argsort(-np.abs(np.log(size[tuple(far.T)])), kind="stable")[:NAMED])
    for channel, point in far[worst].tolist():
        name = f" ({data.kind.ordinates[channel][0].removesuffix('_modulus')})" if len(data.ordinates) > 1 else ""
        place = f"{data.temperature[data.curve[point]]:g} degC at {data.abscissa[point] + data.offset[point]:.4g} {unit}{name}"
        named.append(f"{place}, {size[channel, point]:.3g} times what its curve leads to")
    more = f"; and {len(far) - NAMED} more" if len(far) > NAMED else ""
    one = len(far) == 1
    warn(
        f"{'a point lies' if one else f'{len(far)} points lie'} far off the master curve: {'; '.join(named)}{more}: "
        f"{'it has' if one else 'they have'} next to no weight in the shift factors, but {'is' if one else 'are'} still in the "
        f"master curve: check {'it' if one else 'them'}, or leave {'it' if one else 'them'} out"
    )


def _far(curve: Index, ratio: Floats) -> Floats:
    """The ratio of each point to the middle of its curve, if the point is far from it by the scatter of the curve and that of
    its neighbours; NaN for all other points (n,).
    """
    far = np.full(ratio.size, np.nan)
    for first, last in pairwise(np.searchsorted(curve, np.arange(int(curve[-1]) + 2)).tolist()):
        relative = ratio[first:last] / float(np.median(ratio[first:last]))
        away = np.abs(relative - 1)
        for k in np.flatnonzero(away > max(FAR * 1.4826 * float(np.median(away)), FACTOR)):
            near = away[max(k - NEIGHBOURHOOD, 0) : k + NEIGHBOURHOOD + 1]
            if away[k] > FAR * 1.4826 * float(np.median(near)):
                far[first + k] = relative[k]
    return far
