"""Single points far from the master curve: errors of the instrument or the operator."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from dielast.errors import warn
from dielast.numerics.arrays import Flags, Floats, Index
from dielast.superposition.gather import Gathered
from dielast.superposition.joint_fit import MasterFit

FAR = 8.0  # robust standard deviations, and
FACTOR = 0.05  # relative difference from its curve, above which a point is reported
NEIGHBOURHOOD = 10  # points on either side whose scatter is compared, in addition to that of the whole curve
NAMED = 5  # number of points in a message


def warn_of_outliers(data: Gathered, imposed: Floats, fit: MasterFit, channels: int) -> Flags:
    """Warn of points whose distance from the smooth curves is far larger than that of others of their curve; returns their mask (c,
    n).

    `imposed` (m,) is log10 b where it was prescribed; the first `channels` ordinates were fitted. The distance is relative, not
    logarithmic, so that readings at a noise floor, which may be zero, are not outliers.
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
    """Warn of the worst of the points `far` (k, 2), given as channel and point, in their order."""
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
    """The ratio (n,) of each point to the median of its curve if it is far from it, by the scatter of the curve and by that of its
    neighbours; NaN for all other points.
    """
    far = np.full(ratio.size, np.nan)
    for first, last in pairwise(np.searchsorted(curve, np.arange(int(curve[-1]) + 2)).tolist()):
        relative = ratio[first:last] / float(np.median(ratio[first:last]))
        distance = np.abs(relative - 1)
        for k in np.flatnonzero(distance > max(FAR * 1.4826 * float(np.median(distance)), FACTOR)):
            near = distance[max(k - NEIGHBOURHOOD, 0) : k + NEIGHBOURHOOD + 1]
            if distance[k] > FAR * 1.4826 * float(np.median(near)):
                far[first + k] = relative[k]
    return far
