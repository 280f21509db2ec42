"""Courses along a parameter, outwards from the fit: the least sum of squares with all other parameters refitted.

All courses, one for each parameter and side, advance at once, each at a point of its own, and the models of all of them are
evaluated in one batch. The root of the least sum of squares is nearly linear in the parameter (Bates and Watts 1988, DOI
10.1002/9780470316757, Ch. 6): its slope leads to the place where it has a wanted level, and the tangent of the other parameters to
a start there. With the residuals r, their derivatives J by the parameter and O by the others, and H and h the second derivatives of
half the sum by the others, and by the others and the parameter, at others that are nearly the best ones,

    d = -H^-1 O'r,    S = r'r + d'O'r,    dS/dx = 2 (r'J + h'd),    d(others)/dx = -H^-1 h

are the step to the least sum of squares, this sum, its derivative, and the tangent.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from dielast.calibration.levenberg import LEAST_DAMPING, Descents
from dielast.calibration.likelihood import Likelihood
from dielast.numerics.arrays import Cases, Flags, Floats

CLOSE = 0.01  # share of a sum of squares that the last step, which is not checked, may gain
PRECISE = 1e-4  # share of a sum of squares; a point has converged, too, if a step gains less
MOST_ITERATIONS = 60  # at a point
FIRST_DAMPING = 1e-3  # at a point, whose start is near its end
ACCURATE = 0.02  # accuracy of the end of an interval, as a share of its half width
MOST_CLOSER = 20  # points to close in on the sought root; each shortens the bracket by a tenth at least
NEXT = 1.15  # wanted root over the last one, at least
BEYOND = 1.05  # wanted root over the last level
REACH = 0.3  # longest step, as a share of the distance from the fit to the bound
GROWTH = 2.0  # of a step over the one before
FARTHEST = 1.0  # largest predicted change of another coordinate
TOO_HIGH = 3.0  # rise of the root in a step, over the wanted rise, above which the step is halved
LEAST_RISE = 0.3  # of the root in a step, as a share of the wanted root, for this comparison
MOST_HALVINGS = 8  # of steps in a course
MOST_POINTS = 60  # of a course
LOWER = 0.98  # a root below this share of another one has a better minimum of the others; roots are accurate to about a hundredth

Start = tuple[float, Floats]
"""The coordinate of the parameter at a point, and all coordinates (p,) from which the others are refitted."""


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A point of a course at the coordinate `place`: the `root` of the least sum of squares, infinite if the model cannot be
    evaluated, its `slope` outwards, all coordinates `at` (p,), and their `tangent` (p,), the derivatives by the place.
    """

    place: float
    root: float
    slope: float
    at: Floats
    tangent: Floats


@dataclass(slots=True, eq=False)
class ProfileCourse:
    """The course of the parameter `parameter` on a `side` (-1 or 1) of the fit, with `room` to the bound: its points from the fit
    outwards. The root is wanted at the ascending `levels`; once it exceeds the last one, the place is closed in on where it is
    `sought`.
    """

    parameter: int
    side: float
    room: float
    levels: tuple[float, ...]
    sought: float
    points: list[Point]
    wanted: float = field(default=0.0, init=False)
    halvings: int = field(default=0, init=False)
    closer: int = field(default=0, init=False)
    lowered: set[float] = field(default_factory=set, init=False)
    again: set[tuple[float, float]] = field(default_factory=set, init=False)

    @property
    def closed(self) -> bool:
        """Whether the root exceeds the last level."""
        return self.points[-1].root >= self.levels[-1]

    @property
    def ended(self) -> bool:
        """Whether the course has exceeded the last level or reached the bound, or has very many points."""
        return self.closed or self._distance(self.points[-1]) >= self.room * (1 - 1e-9) or len(self.points) > MOST_POINTS

    @property
    def end(self) -> float:
        """The place beyond which the root exceeds the sought one, NaN if it does not at the last point."""
        bracket = self._bracket()
        return np.nan if bracket is None else between(*bracket, self.sought)

    def add(self, point: Point) -> None:
        """Add a computed point; of two at one place the lower one is kept."""
        before = next((other for other in self.points if other.place == point.place), point)
        if point.root < LOWER * before.root:
            self.lowered.add(point.place)
        lower = min(point, before, key=lambda each: each.root)
        self.points = sorted((*(other for other in self.points if other is not before), lower), key=self._distance)

    def next_start(self) -> Start | None:
        """The start of the next point, None if no further one is needed."""
        return self._once_more() or (self._inwards() if self.ended else self._outwards())

    def start_at(self, place: float) -> Start:
        """The start at a `place` with all other parameters as at the last computed point before it, without extrapolation."""
        inwards = [point for point in self.points if self._distance(point) < self._from_fit(place) and np.isfinite(point.root)]
        return place, inwards[-1].at

    def nearer(self, place: float, root: float) -> Start | None:
        """A start half way to a `place` with a `root` that is too high for one step; None if it is not, or after many halvings."""
        last = self.points[-1]
        if self._from_fit(place) <= self._distance(last):
            return None
        high = last.root + TOO_HIGH * max(self.wanted - last.root, LEAST_RISE * self.wanted)
        if self.ended or root <= high or self.halvings == MOST_HALVINGS:
            return None
        self.halvings += 1
        return self._ahead(0.5 * abs(place - last.place))

    def _distance(self, point: Point) -> float:
        return self._from_fit(point.place)

    def _from_fit(self, place: float) -> float:
        return abs(place - self.points[0].place)

    def _bracket(self) -> tuple[Point, Point] | None:
        """The points beyond which the root exceeds the sought one, None if it does not at the last point."""
        pairs = zip(self.points[-2::-1], self.points[:0:-1], strict=True)
        bracket = next(((inner, outer) for inner, outer in pairs if inner.root <= self.sought), None)
        return bracket if bracket is not None and bracket[1].root > self.sought else None

    def _once_more(self) -> Start | None:
        """The start of a computed point anew from the minimum of the others at the next point, None if none is needed.

        A root that falls outwards shows that the others have a lower minimum, which may hold further inwards, too. A point that was
        lowered so, or a root that rises far more than its slope foresees, shows that the minimum may hold further outwards.
        """
        for inner, outer in reversed(list(zip(self.points[:-1], self.points[1:], strict=True))):
            foreseen = inner.root + TOO_HIGH * inner.slope * abs(outer.place - inner.place)
            falls, rises = outer.root < LOWER * inner.root, foreseen < outer.root < np.inf
            if falls and (inner.place, outer.place) not in self.again:
                self.again.add((inner.place, outer.place))
                return inner.place, outer.at
            if (rises or inner.place in self.lowered) and (outer.place, inner.place) not in self.again:
                self.again.add((outer.place, inner.place))
                return outer.place, inner.at
        return None

    def _outwards(self) -> Start:
        """The start at the next level beyond the last point."""
        last, step = self.points[-1], REACH * self.room
        self.wanted = next((level for level in self.levels[:-1] if level > NEXT * last.root), BEYOND * self.levels[-1])
        if last.slope > 0:
            step = min(step, (self.wanted - last.root) / last.slope)
        if len(self.points) > 1:
            step = min(step, GROWTH * abs(last.place - self.points[-2].place))
        left = self.room - self._distance(last)
        return self._ahead(left if 1.2 * step > left else step)

    def _ahead(self, step: float) -> Start:
        """The start a `step` beyond the last point, along its tangent and the change of the tangent."""
        last, step = self.points[-1], self.side * step
        move = step * last.tangent
        if len(self.points) > 1:
            before = self.points[-2]
            turn = 0.5 * step**2 * (last.tangent - before.tangent) / (last.place - before.place)
            move = move + np.clip(turn, -np.abs(move), np.abs(move))
        return last.place + step, last.at + np.clip(move, -FARTHEST, FARTHEST)

    def _inwards(self) -> Start | None:
        """The start where the root is nearly the sought one; None if a computed point is near, or the root stays below it."""
        bracket = self._bracket()
        if bracket is None or self.closer == MOST_CLOSER:
            return None
        inner, outer = bracket
        length, way = outer.place - inner.place, outer.at - inner.at
        near = min(abs(point.root - self.sought) for point in bracket) <= ACCURATE * self.sought
        if near or abs(length) <= ACCURATE * self._distance(outer):
            return None
        self.closer += 1
        share = float(np.clip((between(inner, outer, self.sought) - inner.place) / length, 0.1, 0.9))
        move = np.clip(share * length * inner.tangent, -FARTHEST, FARTHEST)
        if np.isfinite(outer.root):
            move = share * way + _cubic(share, length * inner.tangent - way, length * outer.tangent - way)
        return inner.place + share * length, inner.at + move


def between(inner: Point, outer: Point, root: float) -> float:
    """Where the root has this value between two points: by a monotone cubic function of the root, with the slopes at both points
    (Fritsch and Carlson 1980, DOI 10.1137/0717021).
    """
    if not np.isfinite(outer.root):
        return 0.5 * (inner.place + outer.place)
    rise, length = outer.root - inner.root, outer.place - inner.place
    share = (root - inner.root) / rise
    slopes = [abs(length) * point.slope for point in (inner, outer)]
    first, last = (min(rise / slope, 3.0) if slope > 0 else 3.0 for slope in slopes)
    return inner.place + length * (share + float(_cubic(share, first - 1, last - 1)))


def _cubic(share: float, first: Floats | float, last: Floats | float) -> Floats:
    """The cubic that is 0 at the shares 0 and 1, with the slopes `first` and `last` there."""
    rest = 1 - share
    return np.asarray(share * rest * (rest * first - share * last))


def opening(likelihood: Likelihood, parameter: int) -> Point:
    """The point of the fit; a parameter without a variance has no slope and no tangent."""
    fit, error = likelihood.fit, float(likelihood.standard_error[parameter])
    known = np.isfinite(error) and error > 0
    tangent = likelihood.covariance[parameter] / error**2 if known else np.eye(fit.coordinates.size)[parameter]
    return Point(float(fit.coordinates[parameter]), 0.0, 1 / error if known else 0.0, fit.coordinates, tangent)


def follow_profiles(likelihood: Likelihood, courses: Sequence[ProfileCourse]) -> None:
    """Follow all courses to their ends."""
    _Followed(likelihood, courses).run()


class _Followed:
    """Courses under way: the `place` (courses,) of the parameter and the `start` (courses, p) of the point that each one is at, and
    the number of `visits` (courses,) of this point.
    """

    def __init__(self, likelihood: Likelihood, courses: Sequence[ProfileCourse]) -> None:
        self.courses, self.bounds = courses, likelihood.fit.space.bounds
        every = np.arange(len(courses))
        self.parameter = np.array([course.parameter for course in courses])
        self.side = np.array([course.side for course in courses])
        self.start = np.repeat(likelihood.fit.coordinates[None], every.size, axis=0)
        self.visits = np.zeros(every.size, dtype=np.intp)
        self.active = np.ones(every.size, dtype=bool)
        for k, course in enumerate(courses):
            self._begin(k, course.next_start())
        free = np.ones(self.start.shape, dtype=bool)
        free[every, self.parameter] = False
        varied = np.ones_like(free)
        self.fits = Descents.begin(likelihood.residuals, self.start, self.bounds, free, varied, bent=True)

    def run(self) -> None:
        """Visit points until all courses have ended."""
        self.fits.damping[:] = FIRST_DAMPING
        self._look(np.arange(self.active.size), np.zeros(self.active.size, dtype=bool))
        while (under_way := np.flatnonzero(self.active)).size:
            anew = self.visits[under_way] == 0
            self.fits.damping[under_way[anew]] = FIRST_DAMPING
            trial = self.start[under_way]
            trial[~anew] = self.fits.trials(under_way[~anew])
            self._look(under_way, self.fits.visit(under_way, trial, PRECISE, anew))

    def _begin(self, k: int, start: Start | None) -> bool:
        """Let a course begin its next point, or end it; whether this is another start than before."""
        before = self.start[k].copy()
        self.active[k], self.visits[k] = start is not None, 0
        if start is not None:
            self.start[k] = start[1]
            self.start[k, self.parameter[k]] = start[0]
            self.start[k] = np.clip(self.start[k], *self.bounds)
        return not np.array_equal(before, self.start[k])

    def _look(self, under_way: Cases, converged: Flags) -> None:
        """Add the points of those courses (k,) that have nearly reached the least sum of squares."""
        lost = ~np.isfinite(self.fits.cost[under_way])
        for k in under_way[lost].tolist():
            # the start may be lost where the others were extrapolated to, rather than because of the parameter
            if self._begin(k, self.courses[k].start_at(self._place(k))):
                continue
            if (closer := self.courses[k].nearer(self._place(k), np.inf)) is None:
                self._arrive(k, np.inf, 0.0, self.fits.at[k], np.zeros(self.start.shape[1]))
            else:
                self._begin(k, closer)
        rows, converged = under_way[~lost], converged[~lost]
        step, least, derivative, tangent = _linearised(self.fits, rows, self.parameter[rows])
        cost, at = self.fits.cost[rows], self.fits.at[rows]
        near = (cost - least <= CLOSE * least) & (np.max(np.abs(step), axis=1) < FARTHEST)
        at = np.where(near[:, None], np.clip(at + step, *self.bounds), at)
        root = np.sqrt(np.where(near, least, cost))
        slope = self.side[rows] * derivative / np.maximum(root, 1e-300)
        for i, k in enumerate(rows.tolist()):
            self.visits[k] += 1
            if self.visits[k] == 1:
                foreseen = float(np.sqrt(max(least[i], 0.0)))
                if (closer := self.courses[k].nearer(self._place(k), foreseen)) is not None:
                    self._begin(k, closer)
                    continue
            if near[i] or converged[i] or self.visits[k] > MOST_ITERATIONS:
                self._arrive(k, float(root[i]), float(slope[i]), at[i], tangent[i])

    def _place(self, k: int) -> float:
        return float(self.start[k, self.parameter[k]])

    def _arrive(self, k: int, root: float, slope: float, at: Floats, tangent: Floats) -> None:
        """Add a point to a course, and begin the next one."""
        self.courses[k].add(Point(self._place(k), root, slope, at.copy(), tangent))
        self._begin(k, self.courses[k].next_start())


def _linearised(fits: Descents, rows: Cases, parameter: Cases) -> tuple[Floats, Floats, Floats, Floats]:
    """For the fits `rows` (k,), whose `parameter` (k,) is fixed: the step (k, p) of all other parameters to the least sum of
    squares, this sum (k,), half its derivative (k,) by the parameter, and the tangent (k, p) of all parameters.
    """
    model, every = fits.model(rows), np.arange(rows.size)
    along = model.normal[every, parameter]
    both = -model.solve(np.stack((model.slope, along), axis=2), np.full(rows.size, LEAST_DAMPING))
    step, tangent = both[:, :, 0], both[:, :, 1]
    tangent[every, parameter] = 1.0
    least = fits.cost[rows] + np.einsum("kp,kp->k", model.slope, step)
    return step, least, model.slope[every, parameter] + np.einsum("kp,kp->k", along, step), tangent
