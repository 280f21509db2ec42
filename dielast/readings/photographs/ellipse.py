"""The ellipse through points of an edge: orthogonal least squares, outliers cut, standard errors of correlated residuals."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from dielast.numerics.arrays import Flags, Floats
from dielast.numerics.robust import robust_deviation

CUT = 3.5  # standard deviations beyond which a point is no part of the edge: one in two thousand of normal ones
HARMONICS = range(3, 17)  # around the outline: an ellipse takes those below, shorter ones are noise of single points
ON_GRID = range(4, 49, 2)  # harmonics that are alike on the four quarters of the outline
MOST_WAVES = 6
BY_CHANCE = 1 / 3  # probability for noise: a wave that is left out keeps outliers in the outline, and moves the ellipse
SURELY = 0.05  # probability for noise below which a wave is one
ROUNDS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Ellipse:
    """The ellipse c + A u, u on the unit circle: `centre` c (2,) and symmetric `shape` A (2, 2), both in pixels.

    x counts columns and y rows, from the middle of the first pixel; y points down. A circle of radius R that is deformed by F has
    the shape R V, with the left stretch tensor V (V^2 = F F^T). `covariance` (5, 5) is that of c_x, c_y, A_xx, A_xy, A_yy.
    """

    centre: Floats
    shape: Floats
    covariance: Floats | None = None

    @classmethod
    def of_moments(cls, centre: Floats, second: Floats) -> Self:
        """The ellipse whose area has this `centre` and these central second moments (2, 2): those of a disc are R^2/4."""
        values, vectors = np.linalg.eigh(second)
        return cls(centre, 2.0 * (vectors * np.sqrt(np.maximum(values, 1e-6))) @ vectors.T)

    @property
    def semi_axes(self) -> Floats:
        """The minor and the major semi-axis (2,)."""
        return np.asarray(np.linalg.eigvalsh(self.shape), dtype=float)

    @property
    def angle(self) -> float:
        """The direction of the major axis in the picture, anticlockwise from the horizontal to the right; degrees in (-90, 90]."""
        major = np.linalg.eigh(self.shape)[1][:, 1]
        angle = float(np.rad2deg(np.arctan2(-major[1], major[0])))
        return 90.0 - (90.0 - angle) % 180.0

    @property
    def perimeter(self) -> float:
        """Ramanujan's first approximation, within 0.5 % for axes of 10:1."""
        b, a = self.semi_axes
        return float(np.pi * (3 * (a + b) - np.sqrt((3 * a + b) * (a + 3 * b))))

    def extent(self, direction: Floats) -> tuple[float, float]:
        """Half the width of the ellipse along a unit vector (2,), and its standard error (0 without a covariance)."""
        along = self.shape @ direction
        extent = float(np.hypot(*along))
        x, y = direction
        slope = np.array([0.0, 0.0, along[0] * x, along[0] * y + along[1] * x, along[1] * y]) / extent
        return extent, 0.0 if self.covariance is None else float(np.sqrt(slope @ self.covariance @ slope))

    def around(self, count: int) -> tuple[Floats, Floats, Floats]:
        """So many points (n, 2) evenly along the outline, their outward unit normals (n, 2), and the curvature there (n,)."""
        dense = np.linspace(0.0, 2 * np.pi, 8 * count + 1)
        walked = np.stack([np.cos(dense), np.sin(dense)], axis=1) @ self.shape
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(walked, axis=0).T))])
        turn = np.interp(np.arange(count) / count * length[-1], length, dense)
        unit = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        normal = unit @ np.linalg.inv(self.shape)
        size = np.hypot(*normal.T)
        # of c + A u: det A / |A u'|^3, and |A u'| = det A |A^-1 u| for a symmetric A
        curvature = 1.0 / (np.linalg.det(self.shape) ** 2 * size**3)
        return self.centre + unit @ self.shape, normal / size[:, None], curvature

    def residuals(self, points: Floats) -> tuple[Floats, Floats]:
        """How far the `points` (n, 2) lie outside (n,), to first order, and the slope (n, 5) of the outline in its parameters."""
        unit = (points - self.centre) @ np.linalg.inv(self.shape)
        unit /= np.maximum(np.hypot(*unit.T), 1e-12)[:, None]
        normal = unit @ np.linalg.inv(self.shape)
        normal /= np.hypot(*normal.T)[:, None]
        away = np.sum(normal * (points - self.centre - unit @ self.shape), axis=1)
        (nx, ny), (ux, uy) = normal.T, unit.T
        return away, np.stack([nx, ny, nx * ux, nx * uy + ny * ux, ny * uy], axis=1)

    def moved(self, change: NDArray[Any]) -> Self:
        """The ellipse with its five parameters changed."""
        return replace(self, centre=self.centre + change[:2], shape=self.shape + change[[[2, 3], [3, 4]]])


def fit_ellipse(points: Floats, usable: Flags, start: Ellipse, least_deviation: float = 0.0) -> tuple[Ellipse, Flags]:
    """The ellipse through the `usable` ones of the `points` (n, 2), by orthogonal least squares, and which points (n,) it keeps.

    Gauss-Newton on the orthogonal distances (Ahn, Rauh & Warnecke, Pattern Recognition 34 (2001) 2283): the algebraic least squares
    of Fitzgibbon, Pilu & Fisher (IEEE Trans. PAMI 21 (1999) 476) shrink an ellipse of few or noisy points. Points beyond `CUT`
    standard deviations, estimated from the median, are cut in every round; `least_deviation` is the smallest deviation assumed.
    Raises `np.linalg.LinAlgError` if the points determine no ellipse.
    """
    ellipse, kept = start, usable
    for round_ in range(ROUNDS):
        away, slopes = ellipse.residuals(points)
        if round_ > 0:
            # the first rounds must not cut what a poor start leaves outside
            limit = CUT * max(robust_deviation(away[usable]), least_deviation)
            fresh = usable & (np.abs(away) <= limit)
            settled, kept = np.array_equal(fresh, kept), fresh
        else:
            settled = False
        if np.count_nonzero(kept) < 8:
            raise np.linalg.LinAlgError("too few points")
        weight = kept / np.maximum(1.0, np.abs(away) / (robust_deviation(away[kept]) + 1e-9)) if round_ < 3 else kept
        of_weight = slopes * weight[:, None]
        change = np.linalg.solve(of_weight.T @ slopes, of_weight.T @ away)
        # a step that turns the outline inside out is none
        size = float(np.linalg.norm(change[2:]))
        change *= min(1.0, 0.5 * float(ellipse.semi_axes[0]) / max(size, 1e-300))
        ellipse = ellipse.moved(change)
        if ellipse.semi_axes[0] <= 0.5:
            raise np.linalg.LinAlgError("no ellipse")
        if settled and np.abs(change).max() < 1e-7 * ellipse.semi_axes[1]:
            break
    return ellipse, kept


def settle(ellipse: Ellipse, points: Floats, usable: Flags, kept: Flags) -> tuple[Ellipse, float, Flags]:
    """The ellipse with its covariance, from the residuals of those of the `points` (n, 2), evenly around it, that it `kept`; the
    deviation of the outline from it at long wavelengths, as a standard deviation in pixels; and which of the `usable` points (n,)
    are kept at last.

    Neighbouring residuals are correlated: blur, wrinkles and the grid of pixels act on many points at once. The five parameters are
    the harmonics 0 to 2 of the outline, so what counts is the power of the residuals at the wavelengths next to these, the average
    S of their periodogram over `HARMONICS`, which stands for the sum of their autocovariance (Priestley, Spectral Analysis and Time
    Series, 1981, Sec. 6.2). White residuals have S equal to their variance; else n var/S points are independent.

    The grid of pixels moves most those points where the outline runs along it, at the ends of the axes of the picture, on which
    the widths along these depend most: the covariance is therefore that of residuals whose variance differs from point to point
    (White, Econometrica 48 (1980) 817), times S over their variance. And where the centre lies on the grid, or halfway, the four
    quarters of the outline meet it alike: their errors add up instead of averaging out, and are seen in the cosines of `ON_GRID`
    alone. The power of these stands for S where it is larger; without such a symmetry both estimate the same.

    On a whole outline waves do not move the ellipse, on one with gaps they do. A wave that stands out from the power at
    `HARMONICS` is therefore fitted together with the ellipse, and points are cut that lie off both. S is
    then that of the residuals from both, and the covariance that of the ellipse beside the waves; the returned deviation has the
    waves in it.
    """
    away, slopes = ellipse.residuals(points)
    turn = 2 * np.pi * np.arange(away.size) / away.size
    numbers, even = (np.array([k for k in range_ if 4 * k < away.size]) for range_ in (HARMONICS, ON_GRID))
    fourier, alike = np.exp(-1j * np.outer(numbers, turn)), np.cos(np.outer(even, turn))
    design: Any = slopes.T
    waves, sure, largest = 0, 0, 0.0
    for _ in range(ROUNDS):
        change = np.linalg.lstsq(design[:, kept].T, away[kept], rcond=None)[0]
        rest = away - change @ design
        power = np.abs(fourier[:, kept] @ rest[kept]) ** 2 / np.count_nonzero(kept)
        largest = max(largest, float(power.sum()))
        strongest = int(np.argmax(power))
        # what lies off the wave is cut before another wave is looked for
        fresh = usable & (np.abs(rest) <= CUT * robust_deviation(rest[kept])) if len(design) > 5 else kept
        if not np.array_equal(fresh, kept):
            kept = fresh
        elif waves < MOST_WAVES and (chance := _chance(power, waves)) < BY_CHANCE:
            waves, sure = waves + 1, sure + (chance < SURELY)
            design = np.concatenate([design, fourier[[strongest]].real, fourier[[strongest]].imag])
        else:
            break
    on_grid = float(np.mean((alike[:, kept] @ rest[kept]) ** 2 / np.sum(alike[:, kept] ** 2, axis=1)))
    # the unsure waves may be the strongest of noise: of n powers, S times exponential variates, the others then add up to this many
    # S on average (Renyi, Acta Math. Acad. Sci. Hung. 4 (1953) 191)
    unsure, noise = waves - sure, power.size - sure
    others = noise - unsure * (1 + float(np.sum(1.0 / np.arange(unsure + 1, noise + 1))))
    # 2n powers determine S: their scatter makes Student's t of a normal error, whose variance is larger
    level = max(float(power.sum()) / max(1, others - 1), on_grid, 1e-12)
    # pictures without noise have the rounding of their last digit
    square = rest[kept] ** 2 + 1e-12
    inverse = np.linalg.inv(design[:, kept] @ design[:, kept].T)
    middle = (design[:, kept] * square) @ design[:, kept].T / square.mean() * level
    covariance = np.asarray(inverse @ middle @ inverse, dtype=float)[:5, :5]
    roughness = float(np.sqrt(2 * largest / np.count_nonzero(kept)))
    return replace(ellipse.moved(change[:5]), covariance=covariance), roughness, kept


def _chance(power: Floats, waves: int) -> float:
    """The probability, at most, that the strongest of the powers (n,) of noise has so large a share of them, apart from the `waves`
    that are fitted already (Fisher, Proc. R. Soc. Lond. A 125 (1929) 54, first term).
    """
    others = power.size - waves
    return others * (1 - float(power.max() / power.sum())) ** (others - 1)
