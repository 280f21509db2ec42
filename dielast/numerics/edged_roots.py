"""Roots of increasing functions, many columns at once, where a function has no value beyond an edge: few rounds of trials.

A trial evaluates the function at one argument. It returns the value; or it ends early, and shows only that the value has passed
zero by then, or that it has not. Values increase with the argument. Where there is a root, inverse interpolation in the square of
the argument (Neville's scheme, up to four values) converges to it within the bracket of the trials so far, which is at least halved
every other round. Where trials end early before any value reaches zero, the bracket contains the edge, and trials converge to the
edge by the times at which they ended. Example: the voltage (argument) for which a film reaches a stretch at a given time. The
stretch rises with the square of a small voltage, and beyond the edge the film fails before that time.
"""

from dataclasses import dataclass, field

import numpy as np

from dielast.numerics.arrays import Flags, Floats, Index

ENDED, PASSED, SHORT = 0, 1, 2  # outcome of a trial: a value; ended early, beyond zero; ended early, below zero
OPEN, FOUND, EDGE, LOW, FAR = range(5)  # still searched; root; no root before the edge; no root above 0; no root up to FURTHEST
FURTHEST = 1e3  # largest argument searched, as a multiple of the largest first argument
NARROWEST = 1e-11  # relative width of a bracket below which rounding decides
ALIKE = 5.0  # largest difference of the values on both sides of an edge, in tolerances, as their errors grow towards the edge
NEAREST = 4  # number of values in an interpolation
GROWTH = 1.5  # largest ratio of arguments from one round to the next, while all values are below zero
DOWNWARDS = np.array((0.0, 0.5, 0.75, 0.93))  # next arguments as fractions of the smallest one beyond zero, while no value is below
WITHIN = np.array((0.25, 0.5, 0.75))  # fractions of a bracket to try where interpolation does not help
CLOSER = np.array((-0.15, -0.02, 0.02, 0.15))  # distances of trials from the expected edge, as fractions of the bracket
# fractions of the bracket to try while the edge cannot be estimated (trials that end at once: cheap)
SPACED = np.arange(1, 10) / 10


@dataclass(slots=True, eq=False)
class EdgedRoots:
    """The search for the roots of columns (k,). It begins with trials of the arguments `first` (k, n).

    Trials so far, arrays (k, trials), NaN where a column has fewer trials: `argument`; `value`, of a trial that ended early below
    zero the value at which it ended; `kind`, its outcome (ENDED, PASSED or SHORT); `lasted`, the logarithm of its actual over its
    intended duration.

    A root is found when the modulus of a value is at most `tolerance` (k,), an edge when the relative width of its bracket is at
    most `gap`, and with `to_edge` when the highest value before it is as accurate as a root. `slope` (k,), if known beforehand, is
    the derivative of the squared argument with respect to the value.
    """

    first: Floats
    tolerance: Floats
    gap: float = 1e-4
    slope: Floats | None = None
    to_edge: bool = False
    argument: Floats = field(init=False)
    value: Floats = field(init=False)
    kind: Floats = field(init=False)
    lasted: Floats = field(init=False)
    slow: Flags = field(init=False)
    """Columns (k,) whose brackets the last trials did not halve."""

    def __post_init__(self) -> None:
        none = np.empty((len(self.first), 0))
        self.argument = self.value = self.kind = self.lasted = none
        self.slow = np.zeros(len(self.first), dtype=bool)

    def note(self, columns: Index, argument: Floats, value: Floats, kind: Index, lasted: Floats) -> None:
        """Add the outcomes of trials (t,), sorted by column; a column may have several."""
        count, width_before = len(self.first), self.above - self.below
        place = np.arange(columns.size) - np.searchsorted(columns, columns)
        width = int(place.max(initial=-1)) + 1
        for name, entries in (("argument", argument), ("value", value), ("kind", kind), ("lasted", lasted)):
            more = np.full((count, width), np.nan)
            more[columns, place] = entries
            setattr(self, name, np.concatenate((getattr(self, name), more), axis=1))
        self.slow = self.above - self.below > 0.5 * width_before

    @property
    def below(self) -> Floats:
        """The lower end of the bracket (k,): the largest argument with a value below zero, NaN where there is none."""
        negative = (self.kind == ENDED) & (self.value < 0) & (self.argument < self._above()[:, None])
        return _largest(np.where(negative, self.argument, -np.inf))

    @property
    def above(self) -> Floats:
        """The upper end of the bracket (k,): the smallest argument beyond the root or the edge, NaN where there is none."""
        return np.where(np.isfinite(self._above()), self._above(), np.nan)

    @property
    def passes(self) -> Flags:
        """Columns (k,) in which a trial reached zero."""
        return np.asarray(np.any(self._over(), axis=1))

    @property
    def state(self) -> Index:
        """The state of the search (k,): OPEN, FOUND, EDGE, LOW or FAR."""
        low, high = self.below, self.above
        best = np.min(np.abs(self._values()), axis=1, initial=np.inf)
        not_below_at_zero = np.any((self.argument == 0) & ~((self.kind == ENDED) & (self.value < 0)), axis=1)
        narrow = high - low <= self.gap * high
        furthest = np.max(np.where(np.isnan(self.argument), 0.0, self.argument), axis=1, initial=0.0)
        edged = narrow & ~self.passes & (self._limited(low, high) if self.to_edge else True)
        conditions = [best <= self.tolerance, not_below_at_zero & self.passes, not_below_at_zero | edged]
        far = np.isnan(high) & (furthest >= FURTHEST * self.first.max(axis=1))
        return np.select([*conditions, far], [FOUND, LOW, EDGE, FAR], OPEN)

    @property
    def root(self) -> Floats:
        """The best estimate of the roots (k,): interpolated within the bracket, else the argument of the value next to zero."""
        low, high = self.below, self.above
        estimate = self._interpolated(np.where(np.isnan(low), 0.0, low), np.where(np.isnan(high), np.inf, high))
        nearest = self._nearest(1)[0][:, 0]
        return np.where(np.isnan(estimate), nearest, estimate)

    @property
    def slope_at_root(self) -> Floats:
        """The derivative of the squared argument with respect to the value (k,), from the two values next to zero."""
        argument, value = self._nearest(2)
        with np.errstate(all="ignore"):
            return np.asarray((argument[:, 1] ** 2 - argument[:, 0] ** 2) / (value[:, 1] - value[:, 0]))

    @property
    def highest(self) -> Floats:
        """The highest value below zero (k,), NaN where there is none; that of the edge itself, where trials came to it."""
        value = _largest(np.where(self.kind == ENDED, np.where(self.value < 0, self.value, -np.inf), -np.inf))
        if not self.to_edge:
            return value
        ended, lasted = self._shortest(self.value), self._shortest(self.lasted)
        with np.errstate(all="ignore"):  # values at which trials ended, up to one that lasts just long enough
            there = ended[0] - lasted[0] * (ended[1] - ended[0]) / (lasted[1] - lasted[0])
        there = np.where(np.isfinite(lasted[0]), there, ended[0])
        return np.where((np.abs(there - value) <= ALIKE * self.tolerance) & (self.state == EDGE), there, value)

    def trials(self) -> tuple[Index, Floats]:
        """Columns (t,) and arguments (t,) of the next trials; columns whose search is over have none."""
        if not self.argument.shape[1]:
            columns = np.repeat(np.arange(len(self.first)), self.first.shape[1])
            return columns, self.first.ravel()
        low, high = self.below, self.above
        rows: list[tuple[Flags, Floats]] = []
        is_open, has_low, has_high = self.state == OPEN, ~np.isnan(low), ~np.isnan(high)
        bottom, top = np.where(has_low, low, 0.0), np.where(has_high, high, np.inf)
        inside = self._interpolated(bottom, top)
        has_estimate = np.isfinite(inside)
        with np.errstate(all="ignore"):
            # upwards: slightly beyond the estimate, so that the values then bracket the root
            upwards = np.where(has_estimate, np.clip(1.02 * inside, 1.02 * low, GROWTH * low), GROWTH * low)
            further = np.where(has_estimate & (inside < GROWTH * low), 1.2, 2.0) * upwards
            rows.append((is_open & has_low & ~has_high, np.stack((upwards, further), axis=1)))
            downwards = DOWNWARDS * high[:, None]
            downwards[:, -1] = np.where(has_estimate, inside, downwards[:, -1])
            rows.append((is_open & ~has_low & has_high, downwards))
            bracketed = is_open & has_low & has_high
            rows.append((bracketed & self.passes & has_estimate, inside[:, None]))
            rows.append((bracketed & self.passes & has_estimate & self.slow, 0.5 * (low + high)[:, None]))
            rows.append((bracketed & self.passes & ~has_estimate, _sections(low, high, WITHIN)))
            edge = self._edge(low, high)
            near_edge = edge[:, None] + CLOSER * (high - low)[:, None]
            for which, trials in ((np.isfinite(edge), near_edge), (np.isnan(edge), _sections(low, high, SPACED))):
                rows.append((bracketed & ~self.passes & which, _with_root(trials, low, high, inside)))
            rows.append((is_open & ~has_low & ~has_high, 0.5 * self.first))  # no trial gave a bound
        columns = np.concatenate([np.repeat(np.flatnonzero(which), entries.shape[1]) for which, entries in rows])
        arguments = np.concatenate([entries[which].ravel() for which, entries in rows])
        columns, arguments = np.unique((columns, arguments), axis=1)
        return columns.astype(np.intp), arguments

    def _edge(self, low: Floats, high: Floats) -> Floats:
        """The argument (k,) at which trials are expected to last just long enough, extrapolated from the two smallest arguments
        that ended early; NaN where it lies outside the bracket or cannot be estimated.
        """
        (first, second), (lasted, shorter) = self._shortest(self.argument), self._shortest(self.lasted)
        lasted, shorter = (np.where(np.isinf(each), np.nan, each) for each in (lasted, shorter))
        edge = first - lasted * (second - first) / (shorter - lasted)
        return np.where((edge > low) & (edge < high), edge, np.nan)

    def _shortest(self, of: Floats) -> Floats:
        """What is known `of` trials (k, trials), for the two smallest arguments (2, k) of trials that ended short; NaN without."""
        none = np.full((len(of), 2), np.nan)
        argument = np.concatenate((np.where(self.kind == SHORT, self.argument, np.nan), none), axis=1)
        order = np.argsort(argument, axis=1, kind="stable")[:, :2]
        short = np.isfinite(np.take_along_axis(argument, order, axis=1))
        return np.where(short, np.take_along_axis(np.concatenate((of, none), axis=1), order, axis=1), np.nan).T

    def _limited(self, low: Floats, high: Floats) -> Flags:
        """Whether the value at the lower end of brackets (k,) about an edge is as high as any, to the tolerance.

        It is where a trial at the upper end ended at that value; and where it has hardly risen since the bracket was four times as
        wide: even of a value with a vertical tangent, which rises with the root of the distance, less than twice that is then left.
        """
        values, width = np.where(self.kind == ENDED, self.value, np.nan), high - low
        here = _largest(np.where(self.argument == low[:, None], values, -np.inf))
        before = _largest(np.where(self.argument <= (high - 4 * width)[:, None], values, -np.inf))
        short = np.where((self.kind == SHORT) & (self.argument == high[:, None]), np.abs(self.value - here[:, None]), np.inf)
        met = np.fmin.reduce(short, axis=1, initial=np.inf) <= self.tolerance
        return np.asarray(met | (here - before <= 0.5 * self.tolerance) | (width <= NARROWEST * high))

    def _over(self) -> Flags:
        """Trials (k, trials) that reached zero; an early end beyond zero counts only if no smaller argument ended short of zero."""
        passed = (self.kind == PASSED) & (self.argument < self._short()[:, None])
        return np.asarray(passed | ((self.kind == ENDED) & (self.value >= 0)))

    def _short(self) -> Floats:
        """The smallest argument of a trial that ended short (k,), infinite without any."""
        return np.asarray(np.min(np.where(self.kind == SHORT, self.argument, np.inf), axis=1, initial=np.inf))

    def _above(self) -> Floats:
        """The smallest argument (k,) that reached zero; if none did, the smallest that ended short; infinite without either."""
        over = np.min(np.where(self._over(), self.argument, np.inf), axis=1, initial=np.inf)
        return np.asarray(np.where(np.isfinite(over), over, self._short()))

    def _values(self) -> Floats:
        """The values (k, trials), infinite where there is none."""
        return np.where(self.kind == ENDED, self.value, np.inf)

    def _nearest(self, count: int) -> tuple[Floats, Floats]:
        """Arguments and values (k, count) of the values next to zero, NaN where there are fewer than `count`."""
        values = self._values()
        values = np.concatenate((values, np.full((len(values), max(0, count - values.shape[1])), np.inf)), axis=1)
        arguments = np.concatenate(
            (self.argument, np.full((len(values), values.shape[1] - self.argument.shape[1]), np.nan)), axis=1
        )
        order = np.argsort(np.abs(values), axis=1, kind="stable")[:, :count]
        chosen = np.take_along_axis(values, order, axis=1)
        finite = np.isfinite(chosen)
        return np.where(finite, np.take_along_axis(arguments, order, axis=1), np.nan), np.where(finite, chosen, np.nan)

    def _interpolated(self, low: Floats, high: Floats) -> Floats:
        """The root by inverse interpolation (k,) of the highest order whose result lies in the bracket; NaN where none does."""
        argument, value = self._nearest(NEAREST)
        square = np.square(argument)
        result = np.full(low.size, np.nan)
        with np.errstate(all="ignore"):
            if self.slope is not None:
                square_at_root = square[:, 0] - self.slope * value[:, 0]
                result = _within(np.sqrt(square_at_root), low, high, result)
            parts = [square[:, place] for place in range(NEAREST)]
            for order in range(1, NEAREST):
                parts = [
                    (value[:, place + order] * parts[place] - value[:, place] * parts[place + 1])
                    / (value[:, place + order] - value[:, place])
                    for place in range(NEAREST - order)
                ]
                result = _within(np.sqrt(parts[0]), low, high, result)
        return result


def _sections(low: Floats, high: Floats, at: Floats) -> Floats:
    """Arguments (k, sections) that divide brackets (k,)."""
    return np.asarray(low[:, None] + at * (high - low)[:, None])


def _with_root(trials: Floats, low: Floats, high: Floats, root: Floats) -> Floats:
    """Arguments (k, n + 1): trials (k, n) clipped to the inside of brackets (k,), and the estimated root (k,) unless it is NaN."""
    margin = 1e-3 * (high - low)[:, None]
    trials = np.clip(trials, low[:, None] + margin, high[:, None] - margin)
    root = np.where(np.isfinite(root), root, trials[:, 0])
    return np.concatenate((trials, root[:, None]), axis=1)


def _within(estimate: Floats, low: Floats, high: Floats, otherwise: Floats) -> Floats:
    """Estimates (k,) that lie within brackets, and `otherwise` (k,) where they do not."""
    return np.where((estimate > low) & (estimate < high), estimate, otherwise)


def _largest(values: Floats) -> Floats:
    """The largest finite value of each row, NaN where there is none."""
    largest = np.max(values, axis=1, initial=-np.inf)
    return np.where(np.isfinite(largest), largest, np.nan)
