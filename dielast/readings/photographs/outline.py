"""The outline of the electrode in one photograph."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dielast.base.errors import InputError
from dielast.numerics.arrays import Floats
from dielast.readings.photographs.camera import Camera
from dielast.readings.photographs.ellipse import Ellipse, fit_ellipse, settle
from dielast.readings.photographs.find import Blob, blobs, reduced
from dielast.readings.photographs.rim import locate, sampled, search

FEWEST, MOST = 96, 2000  # points of an outline: one a pixel between these
# of the minor semi-axis: how far off a rough outline the edge is looked for, less in each round, to leave out other objects
REACHES = (0.15, 0.08, 0.06)
STRONG = 0.4  # of the median rise across the edge: less is no edge of the rough outline
SMALLEST = 8.0  # px: the shortest axis that is measured
LEAST_SEEN = 0.55  # of the outline: with less, strips or the picture's edge decide on the axes
WELL_SEEN = 0.7  # with less, an electrode is doubtful
NOT_SEEN = 0.35  # with less, a message does not call it an electrode
SECOND = 0.5  # of the best region's contrast along its outline: another electrode
CLEAR = 4.0  # standard errors of the contrast of a line: noise has it on one line of thirty thousand
WIDEST = 0.25  # of the minor semi-axis: a wider transition is no edge


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """The outline of the electrode in a photograph, or why there is none.

    `ellipse` is that in the photograph, `flat` that in the plane of the film, where tilt and lens are corrected; they are the same
    without a correction. `seen` is the share of the outline with an edge, `width` the standard deviation of the edge's blur in px,
    `roughness` that of the outline's long waves over its mean radius, `level` the grey value inside over that outside, `holes` the
    share of the inside that is as light as the film.
    """

    ellipse: Ellipse | None = None
    flat: Ellipse | None = None
    seen: float = 0.0
    width: float = 0.0
    roughness: float = 0.0
    level: float = 0.0
    holes: float = 0.0
    inside: bool = True
    """Whether the whole outline lies within the picture."""
    reason: str = ""
    """Why the electrode is lost; empty if it is not."""

    def __repr__(self) -> str:
        if self.flat is None:
            return f"Outline(lost: {self.reason})"
        b, a = 2 * self.flat.semi_axes
        return f"Outline({a:.2f} x {b:.2f} px, {self.flat.angle:.1f} deg, {self.seen:.0%} of the edge seen)"


def find_outline(
    grey: NDArray[Any],
    *,
    dark: bool = True,
    region: tuple[int, int, int, int] | None = None,
    camera: Camera | None = None,
) -> Outline:
    """The outline of the electrode in the picture `grey` (height, width), darker than the film around it, or lighter.

    `region` is left, top, right, bottom in pixels: only this part is looked at. A picture without a clear electrode has an outline
    with a `reason`. Raises `InputError` for an array that is no picture.
    """
    grey = np.asarray(grey)
    if grey.ndim != 2 or grey.dtype.kind not in "uif" or not np.isfinite(grey).all():
        raise InputError("an array of grey values (height, width) is needed, finite numbers", argument="grey")
    left, top = 0, 0
    if region is not None:
        left, top, right, bottom = region
        grey = grey[max(0, top) : bottom, max(0, left) : right]
        left, top = max(0, left), max(0, top)
    if min(grey.shape, default=0) < SMALLEST:
        what = "picture has" if region is None else "region holds"
        return Outline(reason=f"the {what} only {' x '.join(map(str, grey.shape[::-1]))} pixels")
    small, factor = reduced(grey)
    small = small if dark else small.max() + small.min() - small
    found = blobs(small, factor)
    reason = ""
    for blob in found:
        outline = _refined(grey, blob, factor, 1.0 if dark else -1.0, np.array([left, top]), camera)
        if outline.flat is not None:
            others = (other for other in found if other is not blob)
            if any(other.score > SECOND * blob.score and other.support > WELL_SEEN for other in others):
                return Outline(reason="two electrodes are found: state a region that holds one")
            return outline
        reason = reason or outline.reason  # that of the likeliest region
    reason = reason or "no electrode is found"
    return Outline(reason=reason if region is not None else f"{reason}; a region around it may help")


def _refined(grey: NDArray[Any], blob: Blob, factor: int, sign: float, corner: Floats, camera: Camera | None) -> Outline:
    """The outline near a blob, to a fraction of a pixel."""
    ellipse, (height, width) = blob.ellipse, grey.shape
    # the part of the picture with the outline, as grey values that rise outwards
    half = 1.3 * np.sqrt(np.diag(ellipse.shape @ ellipse.shape)) + 12 + 2 * factor
    low = np.maximum(np.floor(ellipse.centre - half), 0).astype(int)
    high = np.minimum(np.ceil(ellipse.centre + half).astype(int) + 1, (width, height))
    part = sign * grey[low[1] : high[1], low[0] : high[0]].astype(np.float32)
    if min(part.shape) < SMALLEST:
        return Outline(reason="no electrode is found")
    ellipse = Ellipse(ellipse.centre - low, ellipse.shape)
    try:
        for share, least in zip(REACHES[:2], (2.5 * factor + 2, 4.0), strict=True):
            count = int(np.clip(ellipse.perimeter, FEWEST, MOST))
            offset, strength = search(part, ellipse, max(least, share * float(ellipse.semi_axes[0])), count)
            start, normal, _ = ellipse.around(count)
            usable = strength > STRONG * np.median(strength[np.isfinite(strength)])
            ellipse, _ = fit_ellipse(start + offset[:, None] * normal, usable, ellipse, least_deviation=0.2)
        count = int(np.clip(ellipse.perimeter, FEWEST, MOST))
        offset, _ = search(part, ellipse, max(4.0, REACHES[2] * float(ellipse.semi_axes[0])), count)
        edge = locate(part, ellipse, offset)
        clear = edge.seen & (edge.contrast > CLEAR * edge.noise)
        ellipse, kept = fit_ellipse(edge.points, clear, ellipse, least_deviation=0.01)
    except np.linalg.LinAlgError:
        return Outline(reason="no electrode is found: its edge is no ellipse")
    if ellipse.semi_axes[0] < SMALLEST / 2:
        return Outline(reason=f"no electrode is found that is {SMALLEST:g} pixels across")
    if edge.width > WIDEST * ellipse.semi_axes[0]:
        return Outline(reason="no electrode is found: nothing has a clear edge")
    points = edge.points + low + corner
    ellipse, roughness, kept = settle(Ellipse(ellipse.centre + low + corner, ellipse.shape), points, clear, kept)
    seen = float(np.mean(kept))
    if seen < LEAST_SEEN:
        few = "no electrode is found" if seen < NOT_SEEN else f"an electrode is seen on only {seen:.0%} of its edge"
        return Outline(reason=few)
    flat = ellipse
    if camera is not None:
        flat, kept = fit_ellipse(camera.flattened(points), kept, camera.flattened_ellipse(ellipse), least_deviation=0.01)
        flat, roughness, _ = settle(flat, camera.flattened(points), kept, kept)
    inner, holes, around = _inside(part, Ellipse(ellipse.centre - low - corner, ellipse.shape))
    spread = np.sqrt(np.diag(ellipse.shape @ ellipse.shape))
    last = corner + np.array([width - 1, height - 1])
    inside = bool(np.all(ellipse.centre - spread >= corner) and np.all(ellipse.centre + spread <= last))
    radius = float(np.sqrt(np.prod(flat.semi_axes)))
    return Outline(ellipse, flat, seen, edge.width, roughness / radius, inner / around if around else 0.0, holes, inside)


def _inside(part: NDArray[Any], ellipse: Ellipse) -> tuple[float, float, float]:
    """The median grey value inside, the share of the inside that is nearer to the film's, and the film's median grey value."""
    radius = np.linspace(0.05, 0.95, 24)
    turn = np.linspace(0.0, 2 * np.pi, 96, endpoint=False)
    unit = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ ellipse.shape
    inner = sampled(part, ellipse.centre + radius[:, None, None] * unit)
    outer = sampled(part, ellipse.centre + 1.15 * unit)
    level, film = float(np.nanmedian(inner)), float(np.nanmedian(outer))
    weight = np.where(np.isfinite(inner), radius[:, None], 0.0)
    with np.errstate(invalid="ignore"):
        light = inner > 0.5 * (level + film)
    return abs(level), float(np.sum(weight * light) / np.sum(weight)), abs(film)
