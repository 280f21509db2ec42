"""Where in a photograph the electrode is, roughly: a threshold on a flattened background, and the best ellipse among the blobs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from dielast.numerics.arrays import Flags, Floats
from dielast.readings.photographs.ellipse import Ellipse, fit_ellipse
from dielast.readings.photographs.rim import sampled

COARSE = 256  # px: longer sides are reduced to between this and its double
LEVELS = 256
MOST = 8  # regions that are looked at, the largest: each takes some milliseconds
SMALLEST = 30  # px of the reduced picture that an electrode covers at least
# of a region's mean radius: half the width of strips and hairs that are cut off; a frame that a wire joins to the electrode makes
# the region larger, so that less is cut off where the first share leaves nothing with an edge
STRIPS = (0.3, 0.15, 0.07)
LARGEST_HOLE = 0.3  # of an electrode's area: glare and marks
ENOUGH = 2000  # pixels for a surface of six constants
BORDER = 0.12  # of the sides: the rim of the picture, where the film is expected
CLEAR = 0.9  # of an outline with an edge: no flatter background makes it clearer
SUPPORT = 0.5  # of an outline that must have an edge: less than the least on which an electrode is measured
RISING = 0.5  # of the rise across an outline where it is clear: what rises as much has an edge


@dataclass(frozen=True, slots=True, eq=False)
class Blob:
    """A region that may be the electrode: its ellipse in the reduced picture, the share of the outline that has an edge
    (`support`), and the contrast across the outline, summed along it.
    """

    ellipse: Ellipse
    support: float
    score: float


def otsu(grey: Floats) -> float:
    """The threshold between two classes of grey values that parts them best (Otsu, IEEE Trans. SMC 9 (1979) 62)."""
    counts, edges = np.histogram(grey, LEVELS)
    middle = 0.5 * (edges[1:] + edges[:-1])
    below = np.cumsum(counts)[:-1]
    above = grey.size - below
    total = np.cumsum(counts * middle)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = below * above * (total[:-1] / below - (total[-1] - total[:-1]) / above) ** 2
    # a gap between the classes: its middle
    best = np.flatnonzero(between >= np.nanmax(between) * (1 - 1e-12))
    return float(edges[1 + best].mean())


def separability(grey: Floats) -> float:
    """The share of the variance that lies between Otsu's two classes."""
    if _is_blank(grey):
        return 0.0
    light = grey > otsu(grey)
    share = light.mean()
    return float(share * (1 - share) * (grey[light].mean() - grey[~light].mean()) ** 2 / grey.var())


def _is_blank(grey: Floats) -> bool:
    """Whether the grey values differ by no more than rounding."""
    return bool(np.ptp(grey) <= 1e-6 * np.abs(grey).max())


def reduced(grey: NDArray[Any]) -> tuple[Floats, int]:
    """The picture with blocks of pixels averaged, so that its longer side is near `COARSE`, and the length of a block in pixels."""
    factor = max(1, max(grey.shape) // COARSE)
    return averaged(grey, factor), factor


def averaged(grey: NDArray[Any], factor: int) -> Floats:
    """The picture with blocks of `factor` by `factor` pixels averaged; what is left over on the right and below is cut off."""
    height, width = (size // factor for size in grey.shape)
    total = np.zeros((height, width))
    for row in range(factor):
        for column in range(factor):
            total += grey[row : height * factor : factor, column : width * factor : factor]
    return total / factor**2


def _surface(grey: Floats, film: Flags) -> Floats:
    """The light on the film: a quadratic surface through the grey values of the `film`, without outliers."""
    height, width = grey.shape
    y, x = np.mgrid[-1 : 1 : 1j * height, -1 : 1 : 1j * width]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    chosen = np.flatnonzero(film)
    chosen = chosen[:: max(1, chosen.size // ENOUGH)]
    design, values, kept = terms.reshape(-1, 6)[chosen], grey.ravel()[chosen], np.ones(chosen.size, dtype=bool)
    coefficients = np.zeros(6)
    for _ in range(5):
        coefficients = np.linalg.lstsq(design[kept], values[kept], rcond=None)[0]
        rest = np.abs(values - design @ coefficients)
        kept = rest <= 2.5 * np.median(rest[kept]) / 0.6745 + 1e-9
    surface: Floats = terms @ coefficients
    return surface


def _flattened(grey: Floats) -> Iterator[Floats]:
    """The picture, and the picture over the light on the film, as its rim and as its lighter part show it."""
    flat = grey
    yield flat
    height, width = grey.shape
    deep = max(2, round(BORDER * min(height, width)))
    rim = np.ones(grey.shape, dtype=bool)
    rim[deep:-deep, deep:-deep] = False
    lightest = float(np.percentile(grey, 99))
    for film in (rim, None):
        if film is None:
            if _is_blank(flat):
                return
            film = flat > otsu(flat)
        if np.count_nonzero(film) < 50:
            continue
        surface = _surface(grey, film)
        # an extrapolated surface may come near zero
        flat = grey / np.maximum(surface, 0.1 * lightest)
        yield flat


def _parts(region: Flags, strip: float) -> Iterator[Flags]:
    """The parts into which a region falls without what is narrower than a share `strip` of its radius (opening by a disc), with
    smaller holes filled.
    """
    area = np.count_nonzero(region)
    filled = ndimage.binary_fill_holes(region)
    if np.count_nonzero(filled) <= (1 + LARGEST_HOLE) * area:
        region = filled
    radius = strip * np.sqrt(area / np.pi)
    padded = np.pad(region, 1, mode="edge")
    cores, count = ndimage.label(ndimage.distance_transform_edt(padded) > radius)
    if count == 0:
        yield region
        return
    away, nearest = ndimage.distance_transform_edt(cores == 0, return_indices=True)
    opened = np.where(away <= radius, cores[tuple(nearest)], 0)[1:-1, 1:-1]
    for label in _largest(opened):
        yield opened == label


def _largest(labels: NDArray[Any]) -> list[int]:
    """The labels of the largest regions that are large enough, the largest first; 0 is none."""
    areas = np.bincount(labels.ravel())
    areas[0] = 0
    order = np.argsort(-areas, kind="stable")[:MOST]
    return [int(label) for label in order if areas[label] >= SMALLEST]


def _rated(grey: Floats, ellipse: Ellipse) -> Blob:
    """The blob of an ellipse, by the contrast across its outline."""
    count = max(32, round(ellipse.perimeter))
    start, normal, _ = ellipse.around(count)
    gap = max(1.5, 0.06 * float(ellipse.semi_axes[0]))
    outside, inside = (sampled(grey, start + side * normal) for side in (gap, -gap))
    rise = np.where(np.isfinite(outside) & np.isfinite(inside), outside - inside, 0.0)
    typical = float(np.percentile(rise, 75))
    support = float(np.mean(rise > RISING * typical)) if typical > 0 else 0.0
    return Blob(ellipse, support, float(np.clip(rise, 0.0, None).sum()))


def _ellipse_of(region: Flags, corner: Sequence[int], picture: tuple[int, ...]) -> Ellipse | None:
    """The ellipse through the boundary of a region, whose window in the `picture` (height, width) begins at the `corner` (x, y), as
    far as it lies within the picture.
    """
    rows, columns = np.nonzero(region)
    middle = np.array([columns.mean(), rows.mean()])
    start = Ellipse.of_moments(middle, np.cov(columns, rows) + np.eye(2) / 12)
    points = np.argwhere(region & ~ndimage.binary_erosion(region))[:, ::-1].astype(float)
    at = points + corner
    points = points[np.all((at >= 2) & (at <= np.array(picture[::-1]) - 3), axis=1)]
    if len(points) < 12:
        return None
    try:
        fitted, kept = fit_ellipse(points, np.ones(len(points), dtype=bool), start, least_deviation=0.5)
    except np.linalg.LinAlgError:
        return None
    if np.count_nonzero(kept) < 0.5 * len(points) or fitted.semi_axes[1] > 4 * max(picture):
        return None
    # the middles of the boundary's pixels lie half a pixel inside
    return Ellipse(fitted.centre + corner, fitted.shape + 0.5 * np.eye(2))


def _candidates(grey: Floats, strip: float) -> list[Blob]:
    """The blobs with an edge along enough of their outline, in the reduced picture."""
    found: list[Blob] = []
    for flat in _flattened(grey):
        # what has an edge all around needs no flatter background
        if _is_blank(flat) or any(blob.support > CLEAR for blob in found):
            continue
        labels, count = ndimage.label(flat <= otsu(flat))
        if count == 0:
            continue
        windows = ndimage.find_objects(labels)
        for label in _largest(labels):
            window = windows[label - 1]
            for part in _parts(labels[window] == label, strip):
                ellipse = _ellipse_of(part, [window[1].start, window[0].start], grey.shape)
                if ellipse is not None:
                    found.append(_rated(flat / (np.percentile(flat, 95) or 1.0), ellipse))
    return [blob for blob in found if blob.support >= SUPPORT]


def blobs(grey: Floats, factor: int) -> list[Blob]:
    """The regions of a reduced picture that may be the electrode, darker than the film, the best first; without those that overlap
    a better one. Their ellipses are those of the full picture, whose blocks of `factor` pixels the reduced one averages.
    """
    found: list[Blob] = []
    for strip in STRIPS:
        found = found or _candidates(grey, strip)
    found.sort(key=lambda blob: -blob.score * blob.support)
    distinct: list[Blob] = []
    for blob in found:
        apart = [np.hypot(*(blob.ellipse.centre - other.ellipse.centre)) / other.ellipse.semi_axes[1] for other in distinct]
        if all(distance > 1 for distance in apart):
            distinct.append(blob)
    offset = (factor - 1) / 2
    return [
        Blob(Ellipse(blob.ellipse.centre * factor + offset, blob.ellipse.shape * factor), blob.support, blob.score)
        for blob in distinct
    ]
