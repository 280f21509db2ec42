"""The geometry of a photograph: the tilt of the camera and its lens, from a square or a circle in the plane of the film."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.optimize import minimize_scalar

from dielast.base.errors import InputError
from dielast.numerics.arrays import Floats
from dielast.readings.photographs.ellipse import Ellipse, fit_ellipse

LARGEST_LENS = 0.5  # relative displacement at the distance `scale`


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """How the plane of the film appears in a photograph: `flattened` undoes it.

    `to_plane` (3, 3) is the homography from the photograph, without the distortion of the lens, to the plane; its pixels are those
    of a camera that looks straight at the middle of the mark. The lens moves a point at the distance r from `middle` (2,) to
    r (1 + lens (r/scale)^2) without distortion (Brown, Photogrammetric Engineering 37 (1971) 855, first term).
    """

    to_plane: Floats
    middle: Floats
    lens: float = 0.0
    scale: float = 1.0
    side: float = 0.0
    """The side of the square, or the diameter of the circle, in pixels of the plane."""

    @classmethod
    def of_square(cls, corners: Sequence[Sequence[float]], picture: tuple[int, int] | None = None) -> Self:
        """From the corners of a square, in order around it, in pixels; further points lie on its sides and determine the lens.

        `picture` is its width and height in pixels, whose middle is that of the lens. Raises `InputError` if the corners are not
        those of a convex quadrilateral.
        """
        points = np.array(corners, dtype=float)
        middle = points[:4].mean(axis=0) if picture is None else (np.array(picture) - 1) / 2
        scale = float(np.hypot(*(points - middle).T).max())
        sides = np.roll(points[:4], -1, axis=0) - points[:4]
        turns = np.roll(sides, -1, axis=0)
        cross = sides[:, 0] * turns[:, 1] - sides[:, 1] * turns[:, 0]
        if not (np.all(cross > 0) or np.all(cross < 0)):
            raise InputError("the corners of a square are needed, in order around it", argument="square")

        def crooked(lens: float) -> float:
            """How far the further points lie off the straight sides, in squared pixels."""
            straight = _without_lens(points, middle, lens, scale)
            ends = straight[:4]
            along = np.roll(ends, -1, axis=0) - ends
            off = straight[4:, None] - ends
            away = (off[..., 0] * along[:, 1] - off[..., 1] * along[:, 0]) / np.hypot(*along.T)
            return float(np.sum(np.min(away**2, axis=1)))

        lens = 0.0
        if len(points) > 4:
            bounds = (-LARGEST_LENS, LARGEST_LENS)
            lens = float(minimize_scalar(crooked, bounds=bounds, method="bounded", options={"xatol": 1e-7}).x)
        straight = _without_lens(points[:4], middle, lens, scale)
        unit = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) - 0.5
        # the direct linear transform (Hartley & Zisserman, Multiple View Geometry, 2004, Sec. 4.1) from the unit square
        rows = []
        for (x, y), (u, v) in zip(unit, straight, strict=True):
            rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y], [0, 0, 0, x, y, 1, -v * x, -v * y]]
        from_square = np.append(np.linalg.solve(np.array(rows), straight.ravel()), 1.0).reshape(3, 3)
        # near the middle of the square, a step in it moves the picture by this Jacobian = U S V: where the tilt does not shorten a
        # length, it is S[0] px; the plane is the square in such pixels, turned and mirrored as the photograph is
        u, v, w = from_square[:, 2]
        jacobian = (from_square[:2, :2] - np.outer([u, v], from_square[2, :2]) / w) / w
        left, stretch, right = np.linalg.svd(jacobian)
        to_pixels = np.eye(3)
        to_pixels[:2, :2] = stretch[0] * left @ right
        to_pixels[:2, 2] = [u / w, v / w]
        return cls(to_pixels @ np.linalg.inv(from_square), middle, lens, scale, float(stretch[0]))

    @classmethod
    def of_circle(cls, points: Sequence[Sequence[float]]) -> Self:
        """From five or more points on a circle, in pixels, for a camera that is far away: tilt makes it an ellipse.

        Raises `InputError` if the points do not determine an ellipse.
        """
        rim = np.array(points, dtype=float)
        start = Ellipse.of_moments(rim.mean(axis=0), np.cov(rim.T) / 2)
        try:
            ellipse, _ = fit_ellipse(rim, np.ones(len(rim), dtype=bool), start, least_deviation=1e9)
        except np.linalg.LinAlgError:
            raise InputError("points around a circle are needed, eight or more", argument="circle") from None
        to_plane = np.eye(3)
        # the major axis is not shortened
        to_plane[:2, :2] = ellipse.semi_axes[1] * np.linalg.inv(ellipse.shape)
        to_plane[:2, 2] = ellipse.centre - to_plane[:2, :2] @ ellipse.centre
        return cls(to_plane, ellipse.centre, side=2 * float(ellipse.semi_axes[1]))

    def flattened(self, points: Floats) -> Floats:
        """Points (n, 2) of the photograph in the plane of the film."""
        straight = _without_lens(points, self.middle, self.lens, self.scale)
        mapped = np.column_stack([straight, np.ones(len(straight))]) @ self.to_plane.T
        flat: Floats = mapped[:, :2] / mapped[:, 2:]
        return flat

    def flattened_ellipse(self, ellipse: Ellipse) -> Ellipse:
        """An ellipse of the photograph in the plane of the film, nearly."""
        points = self.flattened(ellipse.around(64)[0])
        return Ellipse.of_moments(points.mean(axis=0), np.cov(points.T) / 2)

    def turned(self, direction: Floats, at: Floats) -> Floats:
        """A direction (2,) of the photograph at a point (2,) as a unit vector in the plane of the film."""
        ends = self.flattened(np.stack([at - direction, at + direction]))
        along = ends[1] - ends[0]
        unit: Floats = along / np.hypot(*along)
        return unit


def _without_lens(points: Floats, middle: Floats, lens: float, scale: float) -> Floats:
    away = points - middle
    straight: Floats = middle + away * (1 + lens * np.sum(away**2, axis=1, keepdims=True) / scale**2)
    return straight
