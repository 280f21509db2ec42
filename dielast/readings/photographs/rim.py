"""The edge of an electrode along a line around it, at a fraction of a pixel, from the grey values across that line."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import ndtr

from dielast.numerics.arrays import Flags, Floats
from dielast.readings.photographs.ellipse import Ellipse

STEP = 0.5  # px between two samples across an edge
NARROWEST = 1.2  # px: an edge that is sharper than the pixels is read with a wider one, which the grid of pixels disturbs less
REACH = 3.0  # widths of the edge on either side that are read
LEAST_CONTRAST, MOST_CONTRAST = 0.5, 2.0  # of the median contrast: else another object lies over the edge
ROUNDS = 6
_ROOT = np.sqrt(2 * np.pi)


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """The edge across n lines: its `points` (n, 2), whether it is there (`seen`, n), its `contrast` (n,), outside less inside, with
    the standard error `noise` (n,), and the common `width` of the blur, the standard deviation of its spread in pixels.
    """

    points: Floats
    seen: Flags
    contrast: Floats
    noise: Floats
    width: float


def sampled(grey: NDArray[Any], points: Floats, order: Literal[1, 3] = 3) -> Floats:
    """Grey values at `points` (..., 2), smoothed by the B-spline of this order; NaN outside of the picture.

    The spline is the smoothing kernel itself (of order 3: variance 1/3 px^2), not the interpolant: no filter has to run over the
    whole picture, and a straight edge keeps its place.
    """
    values = ndimage.map_coordinates(grey, (points[..., 1], points[..., 0]), order=order, prefilter=False, mode="nearest")
    height, width = grey.shape
    inside = (points[..., 0] >= 0) & (points[..., 0] <= width - 1) & (points[..., 1] >= 0) & (points[..., 1] <= height - 1)
    return np.where(inside, values, np.nan)


def search(grey: NDArray[Any], ellipse: Ellipse, reach: float, count: int) -> tuple[Floats, Floats]:
    """Where across the outline, within `reach` px, the grey value rises most (outwards): `offset` (n,) and `strength` (n,)."""
    start, normal, _ = ellipse.around(count)
    step = max(STEP, reach / 40)
    offsets = np.arange(-reach, reach + step / 2, step)
    across = sampled(grey, start[:, None] + offsets[:, None] * normal[:, None], order=1)
    rise = ndimage.gaussian_filter1d(across, max(1.5, 1.5 / step) if step < 1 else 1.5, axis=1, order=1, mode="nearest")
    rise = np.where(np.isfinite(rise), rise, -np.inf)
    best = np.argmax(rise, axis=1)
    return offsets[best], rise[np.arange(count), best]


def _step(t: Floats, width: float) -> Floats:
    """A constant, the step Phi(t/s), and its slopes in t0 and in s, at `t` (k,): the columns of (k, 4)."""
    bell = np.exp(-0.5 * (t / width) ** 2) / (_ROOT * width)
    return np.stack([np.ones(t.size), ndtr(t / width), -bell, -(t / width) * bell], axis=1)


def locate(grey: NDArray[Any], ellipse: Ellipse, offset: Floats) -> Edge:
    """The edge near the `offset` (n,) from the outline of the ellipse, by least squares.

    Across the edge the grey value is a + c Phi((t - t0)/s), a step between two levels that is blurred by a Gauss function; a, c and
    t0 are fitted to each line, the width s to all together. Because the step is odd about t0, another symmetric blur, or a slope of
    the light, leaves t0 in place. A blur of standard deviation s moves a curved edge by s^2/2 times its curvature inwards (Verbeek
    & van Vliet, IEEE Trans. PAMI 15 (1993) 726), which is added back.
    """
    start, normal, curvature = ellipse.around(offset.size)
    place, width, blur = offset.copy(), 1.5, 1.5
    seen: Any = np.ones(offset.size, dtype=bool)
    for _ in range(ROUNDS):
        reach = REACH * width
        t = np.arange(-np.ceil(reach / STEP), np.ceil(reach / STEP) + 1) * STEP
        values = sampled(grey, start[:, None] + (place[:, None] + t)[..., None] * normal[:, None])
        complete: Any = np.isfinite(values).all(axis=1)
        values = np.where(complete[:, None], values, 0.0)
        model = _step(t, width)[:, :3]
        fitted = np.linalg.pinv(model) @ values.T
        contrast, deviation = fitted[1], np.sqrt(np.mean((values.T - model @ fitted) ** 2, axis=0))
        level = float(np.median(contrast[complete])) if complete.any() else 0.0
        if level <= 0:
            return Edge(start, np.zeros_like(seen), contrast, deviation, width)
        with np.errstate(divide="ignore", invalid="ignore"):
            # a narrower step than that of the model moves the fit by more than itself
            shift = fitted[2] / contrast * np.sqrt(0.5 + 0.5 * (blur / width) ** 2)
        seen = complete & (contrast > LEAST_CONTRAST * level) & (contrast < MOST_CONTRAST * level) & (np.abs(shift) < reach / 2)
        if not np.any(seen):
            break
        place = place + np.where(seen, np.clip(shift, -reach / 2, reach / 2), 0.0)
        of_blur = np.linalg.pinv(_step(t, blur)) @ values.T[:, seen]
        blur = float(np.clip(blur + np.median(of_blur[3] / of_blur[1]), 0.5 * blur, 2.0 * blur))
        width = max(NARROWEST, blur)
    # the errors of samples closer than the kernel are not independent
    noise = deviation * np.sqrt(np.linalg.inv(model.T @ model)[1, 1] / STEP)
    along = place + np.where(seen, 0.5 * blur**2 * curvature, 0.0)
    return Edge(start + along[:, None] * normal, seen, contrast, noise, blur)
