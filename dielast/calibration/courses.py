"""Courses along one parameter, outwards from the fit: the least sum of squares, with all other parameters refitted.

All courses, one for each parameter and side, advance at once: each is at a point of its own, and the models of all of them are
evaluated in one batch. The root of the sum of squares is nearly linear in the parameter (Bates and Watts 1988, DOI
10.1002/9780470316757, Ch. 6), so its slope leads to the place where it has a wanted level, and the tangent of the other parameters
leads to a start there. With the residuals r and their derivatives J by the parameter and O by the others, at a point that is nearly
the least one,

    d = -(O'O)^-1 O'r,    S = |r + O d|^2,    dS/dx = 2 J'(r + O d),    d(others)/dx = -(O'O)^-1 O'J:

the step to the least sum of squares of the linearised problem, this sum, its derivative and the tangent.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dielast.calibration.levenberg import Descents
from dielast.calibration.likelihood import Likelihood
from dielast.numerics.arrays import Cases, Flags, Floats

CLOSE = 0.01  # the step to the least sum of squares is linear if it gains less than this share of it
PRECISE = 1e-3  # gain of a step, as a share of a sum of squares, at which a point has converged otherwise
LEAST_CURVATURE = 1e-9  # over that of a parameter alone: less is a rounding error
MOST_ITERATIONS = 60  # at one point
FIRST_DAMPING = 1e-3  # at a point: its start is near its end
TOO_FAR = 3.0  # rise of the root between points, over that wanted, beyond which the step is halved
HALVINGS = 5  # of one step
GROW = 2.0  # of a step over the last one
REACH = 0.3  # longest step, as a share of the distance from the fit to the bound
BEYOND = 1.05  # the root that is wanted beyond the last level, over this level
FARTHEST = 1.0  # predicted change of another parameter


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A point of a course at the coordinate `place`: the `root` of the least sum of squares and its `slope` outwards, all
    coordinates `at` (p,), and their `tangent` (p,), the derivatives by the place.
    """

    place: float
    root: float
    slope: float
    at: Floats
    tangent: Floats


@dataclass(slots=True, eq=False)
class Course:
    """The course of the parameter `own` on one `side` (-1 or 1) of the fit, `room` from it to the bound, its points from the fit
    outwards. The root is wanted at ascending `levels`; once it is beyond the last one, the place where it is the level `sought` is
    closed in on.
    """

    own: int
    side: float
    room: float
    levels: tuple[float, ...]
    sought: float
    accuracy: float
    points: list[Point] = field(default_factory=list)
    wanted: float = 0.0  # root at the next point
    halved: int = 0

    @property
    def closed(self) -> bool:
        """Whether the root exceeds the last level."""
        return self.points[-1].root >= self.levels[-1]

    @property
    def ended(self) -> bool:
        """Whether the course is closed or at the bound."""
        return self.closed or self._distance(self.points[-1]) >= self.room * (1 - 1e-9)

    def _distance(self, point: Point) -> float:
        return abs(point.place - self.points[0].place)

    def next_start(self) -> tuple[float, Floats] | None:
        """The place of the next point and all coordinates (p,) at its start, None if the course needs no further point."""
        self.halved = 0
        return self._within() if self.ended else self._outwards()

    def _outwards(self) -> tuple[float, Floats]:
        last = self.points[-1]
        self.wanted = next((level for level in self.levels[:-1] if level > 1.15 * last.root), BEYOND * self.levels[-1])
        covered = self._distance(last)
        step = REACH * self.room
        if last.slope > 0:
            step = min(step, (self.wanted - last.root) / last.slope)
        if len(self.points) > 1:
            step = min(step, GROW * abs(last.place - self.points[-2].place))
        if covered + 1.2 * step > self.room:
            step = self.room - covered
        return self._ahead(step)

    def _ahead(self, step: float) -> tuple[float, Floats]:
        """A step from the last point, along its tangent and the change of the tangent."""
        last, step = self.points[-1], self.side * step
        move = step * last.tangent
        if len(self.points) > 1:
            before = self.points[-2]
            bend = 0.5 * step**2 * (last.tangent - before.tangent) / (last.place - before.place)
            move = move + np.clip(bend, -np.abs(move), np.abs(move))
        return last.place + step, last.at + np.clip(move, -FARTHEST, FARTHEST)

    def nearer(self, place: float) -> tuple[float, Floats] | None:
        """Half way to the `place` from the last point; None after many halvings."""
        self.halved += 1
        return None if self.halved > HALVINGS else self._ahead(0.5 * abs(place - self.points[-1].place))

    def _within(self) -> tuple[float, Floats] | None:
        """A point where the root is nearly the level sought; None if there is one."""
        if not self.closed or (crossing := self._crossing()) is None:
            return None
        inner, outer = crossing
        nearest = min(abs(inner.root - self.sought), abs(outer.root - self.sought))
        if nearest <= self.accuracy * self.sought:
            return None
        length = outer.place - inner.place
        self.wanted = self.sought
        share = float(np.clip((between(inner, outer, self.sought) - inner.place) / length, 0.1, 0.9))
        place = inner.place + share * length
        if not np.isfinite(outer.root):
            return place, inner.at + np.clip(share * length * inner.tangent, -FARTHEST, FARTHEST)
        # the cubic through both points with their tangents
        rest = 1 - share
        bend = share * rest * (rest * (length * inner.tangent - (outer.at - inner.at)) - share * (length * outer.tangent - (outer.at - inner.at)))
        return place, rest * inner.at + share * outer.at + bend

    def _crossing(self) -> tuple[Point, Point] | None:
        """The points between which the root first exceeds the level sought."""
        for inner, outer in zip(self.points[:-1], self.points[1:], strict=True):
            if outer.root > self.sought:
                return inner, outer
        return None

    def add(self, point: Point) -> None:
        """Add a point in its place."""
        self.points.append(point)
        self.points = sorted(self.points, key=self._distance)

    def end(self) -> float:
        """The place where the root first exceeds the level sought, NaN if it does not."""
        crossing = self._crossing()
        return np.nan if crossing is None else between(*crossing, self.sought)


def between(inner: Point, outer: Point, root: float) -> float:
    """Where the root has a value between those of two points: a monotone cubic in the root (Fritsch and Carlson 1980, DOI
    10.1137/0717021)."""
    if not np.isfinite(outer.root):
        return 0.5 * (inner.place + outer.place)
    rise, length = outer.root - inner.root, outer.place - inner.place
    share = (root - inner.root) / rise
    # derivatives of the share of the length by the share of the rise
    first, last = (float(np.clip(rise / (abs(length) * point.slope), 0.0, 3.0)) if point.slope > 0 else 3.0 for point in (inner, outer))
    rest = 1 - share
    return inner.place + length * (share + share * rest * (rest * (first - 1) - share * (last - 1)))


def follow(likelihood: Likelihood, courses: list[Course]) -> None:
    """Follow all courses to their ends."""
    fit = likelihood.fit
    lower, upper = fit.space.bounds
    size = fit.coordinates.size
    own = np.array([course.own for course in courses])
    side = np.array([course.side for course in courses])
    covariance = np.where(np.isfinite(likelihood.covariance), likelihood.covariance, 0.0)
    for course in courses:
        variance, error = covariance[course.own, course.own], likelihood.standard_error[course.own]
        known = np.isfinite(error) and variance > 0
        tangent = covariance[course.own] / variance if known else np.eye(size)[course.own]
        course.points.append(
            Point(float(fit.coordinates[course.own]), 0.0, 1 / error if known else 0.0, fit.coordinates, tangent)
        )
    places = np.zeros(len(courses))
    starts = np.zeros((len(courses), size))
    active = np.zeros(len(courses), dtype=bool)
    age = np.zeros(len(courses), dtype=np.intp)

    def begin(k: int, following: tuple[float, Floats] | None) -> None:
        active[k] = following is not None
        if following is not None:
            places[k], starts[k] = following
            places[k] = np.clip(places[k], lower[own[k]], upper[own[k]])
            starts[k] = np.clip(starts[k], lower, upper)
            starts[k, own[k]] = places[k]
            age[k] = 0

    for k, course in enumerate(courses):
        begin(k, course.next_start())
    free = np.ones((len(courses), size), dtype=bool)
    free[np.arange(len(courses)), own] = False
    fits = Descents.begin(likelihood.residuals, starts, lower, upper, free, np.ones_like(free))
    rows, converged = np.arange(len(courses)), np.zeros(len(courses), dtype=bool)
    fits.damping[:] = FIRST_DAMPING
    while rows.size:
        step, least, slope, tangent = _linearised(fits, rows, own[rows])
        for i, k in enumerate(rows.tolist()):
            course, cost = courses[k], float(fits.cost[k])
            root = float(np.sqrt(max(least[i], 0.0)))
            if age[k] == 0:
                last = course.points[-1]
                if not course.ended and (not np.isfinite(cost) or root - last.root > TOO_FAR * max(course.wanted - last.root, 0.3 * course.wanted)):
                    closer = course.nearer(places[k])
                    if closer is not None:
                        begin(k, closer)
                        continue
                if not np.isfinite(cost):
                    course.add(Point(float(places[k]), np.inf, 0.0, fits.at[k].copy(), tangent[i]))
                    begin(k, course.next_start())
                    continue
            linear = cost - least[i] <= CLOSE * least[i] and np.max(np.abs(step[i])) < FARTHEST
            age[k] += 1
            if not (linear or converged[i] or age[k] > MOST_ITERATIONS):
                continue
            at = fits.at[k].copy()
            if linear:
                at = np.clip(at + step[i], lower, upper)
                rise, sloped = root, side[k] * slope[i]
            else:
                rise, sloped = float(np.sqrt(cost)), side[k] * slope[i]
            course.add(Point(float(places[k]), rise, sloped / max(rise, 1e-300), at, tangent[i]))
            begin(k, course.next_start())
        rows = np.flatnonzero(active)
        if rows.size:
            anew = age[rows] == 0
            fits.damping[rows[anew]] = FIRST_DAMPING
            trial = np.where(anew[:, None], starts[rows], fits.trials(rows))
            converged = fits.visit(rows, trial, PRECISE, anew)


def _linearised(fits: Descents, rows: Cases, own: Cases) -> tuple[Floats, Floats, Floats, Floats]:
    """For the fits of these `rows` (k,), whose parameter `own` (k,) is fixed: the step (k, p) of all other parameters to the least sum of squares of the linearised
    problem, this sum (k,), half its derivative (k,) by the fixed parameter, and the tangent (k, p) of all parameters.
    """
    there, jacobian, at = fits.there[rows], fits.jacobian[rows], fits.at[rows]
    with np.errstate(all="ignore"):
        slope = np.einsum("knp,kn->kp", jacobian, there)
        normal = np.einsum("knp,knq->kpq", jacobian, jacobian)
    lost = ~np.isfinite(fits.cost[rows])
    slope[lost], normal[lost] = 0.0, np.eye(at.shape[1])
    size = np.sqrt(np.einsum("kpp->kp", normal))
    moving = fits.free[rows] & ~((at <= fits.lower) & (slope > 0)) & ~((at >= fits.upper) & (slope < 0)) & (size > 0)
    scale = np.where(size > 0, size, 1.0)
    index, every = np.arange(at.shape[1]), np.arange(rows.size)
    matrix = np.where(moving[:, :, None] & moving[:, None, :], normal / (scale[:, :, None] * scale[:, None, :]), 0.0)
    matrix[:, index, index] = np.where(moving, 1 + LEAST_CURVATURE, 1.0)
    along = normal[every, own]  # (k, p)
    right = np.stack((np.where(moving, slope, 0.0), np.where(moving, along, 0.0)), axis=2) / scale[:, :, None]
    step, tangent = np.moveaxis(-np.linalg.solve(matrix, right) / scale[:, :, None], 2, 0)
    tangent[every, own] = 1.0
    least = np.where(lost, np.inf, fits.cost[rows] + np.einsum("kp,kp->k", slope, step))
    derivative = slope[every, own] + np.einsum("kp,kp->k", along, step)
    return step, least, derivative, tangent
