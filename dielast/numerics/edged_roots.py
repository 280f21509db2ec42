"""Where rising functions of many columns pass zero, where beyond an edge a function has no value: found in few rounds of trials.

A trial of an argument tells the value of the function; or only that it has passed zero before it ended; or that it ended short of
zero. Values rise with the argument. Where there is a root, inverse interpolation in the square of the argument closes in on it from
the values known (Neville's scheme, up to four of them), within the bracket that the trials make, which at least halves every other
round; where values end short of zero, the bracket is about the edge, and trials close in on that by the times at which they ended.
A voltage that is to reach a stretch at a time is such an argument: the stretch begins with its square, and beyond some voltage the
film fails before.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dielast.numerics.arrays import Flags, Floats, Index

ENDED, PASSED, SHORT = 0, 1, 2  # a trial that came to its end, one that ended beyond zero, one that ended short of it
OPEN, FOUND, EDGE, LOW, FAR = range(5)  # not known yet; a root; none before the edge; none above 0; none up to FURTHEST
FURTHEST = 1e3  # times the largest argument tried first, up to which a root is looked for
NARROWEST = 1e-11  # a bracket, relative, beyond which rounding decides
ALIKE = 5.0  # tolerances: how far what trials tell from both sides of an edge may differ, as their errors grow towards it
NEAREST = 4  # values that an interpolation takes
GROWTH = 1.5  # of the argument from one round to the next, at most, while all values are below zero
DOWNWARDS = np.array((0.0, 0.5, 0.75, 0.93))  # of the lowest argument beyond zero, while no value is below zero
WITHIN = np.array((0.25, 0.5, 0.75))  # of a bracket that interpolation does not help to divide
CLOSER = np.array((-0.15, -0.02, 0.02, 0.15))  # of a bracket about an edge: how far trials lie from where the edge is expected
SPACED = np.arange(1, 10) / 10  # of such a bracket, while nothing is expected: trials that end at once do not tell, and cost little


@dataclass(slots=True, eq=False)
class EdgedRoots:
    """The search for the roots of columns (k,), which begins with trials of the arguments `first` (k, some). Of the trials so far
    it knows the `argument`, the `value` (NaN where a trial has none), how they ended (`kind`), and the logarithm of how long they
    `lasted` over how long they were to last, (k, trials) each; NaN is no trial.

    A root is found where a value is no larger than `tolerance` (k,), an edge where the bracket about it is narrower than `gap`
    (relative), and if `to_edge` the highest value before it is as exact as a root. `slope` (k,) is what the square of the argument
    changes by with the value, where it is known beforehand.
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
        """The outcome of trials (t,) of some columns, one or several each, in order of columns; the value of one that ended short
        is that at which it ended.
        """
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
        """The largest argument (k,) of a value below zero that is within the bracket, NaN where there is none."""
        known = (self.kind == ENDED) & (self.value < 0) & (self.argument < self._above()[:, None])
        return _largest(np.where(known, self.argument, -np.inf))

    @property
    def above(self) -> Floats:
        """The smallest argument (k,) beyond zero, or beyond the edge; NaN where there is none."""
        return np.where(np.isfinite(self._above()), self._above(), np.nan)

    @property
    def passes(self) -> Flags:
        """Columns (k,) in which a trial came to zero."""
        return np.asarray(np.any(self._over(), axis=1))

    @property
    def state(self) -> Index:
        """What is known of each column (k,): OPEN, FOUND, EDGE, LOW or FAR."""
        low, high = self.below, self.above
        best = np.min(np.abs(self._values()), axis=1, initial=np.inf)
        tried_nothing = np.any((self.argument == 0) & ~((self.kind == ENDED) & (self.value < 0)), axis=1)
        narrow = high - low <= self.gap * high
        furthest = np.max(np.where(np.isnan(self.argument), 0.0, self.argument), axis=1, initial=0.0)
        edged = narrow & ~self.passes & (self._limited(low, high) if self.to_edge else True)
        conditions = [best <= self.tolerance, tried_nothing & self.passes, tried_nothing | edged]
        far = np.isnan(high) & (furthest >= FURTHEST * self.first.max(axis=1))
        return np.select([*conditions, far], [FOUND, LOW, EDGE, FAR], OPEN)

    @property
    def root(self) -> Floats:
        """Where the values pass zero (k,) as far as it is known: interpolated from the nearest ones, within the bracket."""
        low, high = self.below, self.above
        estimate = self._interpolated(np.where(np.isnan(low), 0.0, low), np.where(np.isnan(high), np.inf, high))
        nearest = self._nearest(1)[0][:, 0]
        return np.where(np.isnan(estimate), nearest, estimate)

    @property
    def slope_at_root(self) -> Floats:
        """What the square of the argument changes by with the value (k,), between the two values next to zero."""
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
        """Columns (t,) and arguments (t,) of the next trials, none for columns that need none."""
        if not self.argument.shape[1]:
            columns = np.repeat(np.arange(len(self.first)), self.first.shape[1])
            return columns, self.first.ravel()
        low, high = self.below, self.above
        rows: list[tuple[Flags, Floats]] = []
        is_open, has_low, has_high = self.state == OPEN, ~np.isnan(low), ~np.isnan(high)
        bottom, top = np.where(has_low, low, 0.0), np.where(has_high, high, np.inf)
        inside = self._interpolated(bottom, top)
        known = np.isfinite(inside)
        with np.errstate(all="ignore"):
            # upwards: a little beyond what is expected, so that the root lies between values
            upwards = np.where(known, np.clip(1.02 * inside, 1.02 * low, GROWTH * low), GROWTH * low)
            further = np.where(known & (inside < GROWTH * low), 1.2, 2.0) * upwards
            rows.append((is_open & has_low & ~has_high, np.stack((upwards, further), axis=1)))
            downwards = DOWNWARDS * high[:, None]
            downwards[:, -1] = np.where(known, inside, downwards[:, -1])
            rows.append((is_open & ~has_low & has_high, downwards))
            between = is_open & has_low & has_high
            rows.append((between & self.passes & known, inside[:, None]))
            rows.append((between & self.passes & known & self.slow, 0.5 * (low + high)[:, None]))
            rows.append((between & self.passes & ~known, _sections(low, high, WITHIN)))
            edge = self._edge(low, high)
            near = edge[:, None] + CLOSER * (high - low)[:, None]
            for which, about in ((np.isfinite(edge), near), (np.isnan(edge), _sections(low, high, SPACED))):
                rows.append((between & ~self.passes & which, _with_root(about, low, high, inside)))
            rows.append((is_open & ~has_low & ~has_high, 0.5 * self.first))  # no trial told anything
        columns = np.concatenate([np.repeat(np.flatnonzero(which), entries.shape[1]) for which, entries in rows])
        arguments = np.concatenate([entries[which].ravel() for which, entries in rows])
        order = np.lexsort((arguments, columns))
        columns, arguments = columns[order], arguments[order]
        new = (np.diff(columns, prepend=-1) != 0) | (np.diff(arguments, prepend=np.nan) != 0)
        return columns[new], arguments[new]

    def _edge(self, low: Floats, high: Floats) -> Floats:
        """Where trials are expected to last just long enough (k,), by the two that came nearest to that; NaN where they do not
        tell, or not within brackets (k,).
        """
        (first, second), (lasted, shorter) = self._shortest(self.argument), self._shortest(self.lasted)
        lasted, shorter = (np.where(np.isinf(each), np.nan, each) for each in (lasted, shorter))
        edge = first - lasted * (second - first) / (shorter - lasted)
        return np.where((edge > low) & (edge < high), edge, np.nan)

    def _shortest(self, of: Floats) -> Floats:
        """What is known `of` trials (k, trials), for the two smallest arguments (2, k) of trials that ended short; NaN without."""
        argument = np.concatenate(
            (np.where(self.kind == SHORT, self.argument, np.inf), np.full((len(self.first), 2), np.inf)), axis=1
        )
        order = np.argsort(argument, axis=1, kind="stable")[:, :2]
        values = np.concatenate((of, np.full((len(of), 2), np.nan)), axis=1)
        chosen = np.where(
            np.isfinite(np.take_along_axis(argument, order, axis=1)), np.take_along_axis(values, order, axis=1), np.nan
        )
        return np.asarray(chosen.T)

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
        """Trials (k, trials) that came to zero; one that passed it beyond a trial that ended short tells nothing about less."""
        passed = (self.kind == PASSED) & (self.argument < self._short()[:, None])
        return np.asarray(passed | ((self.kind == ENDED) & (self.value >= 0)))

    def _short(self) -> Floats:
        """The smallest argument of a trial that ended short (k,), infinite without any."""
        return np.asarray(np.min(np.where(self.kind == SHORT, self.argument, np.inf), axis=1, initial=np.inf))

    def _above(self) -> Floats:
        """The smallest argument that came to zero (k,); without one, that of a trial that ended short; infinite without any."""
        over = np.min(np.where(self._over(), self.argument, np.inf), axis=1, initial=np.inf)
        return np.asarray(np.where(np.isfinite(over), over, self._short()))

    def _values(self) -> Floats:
        """The values (k, trials), infinite where there is none."""
        return np.where(self.kind == ENDED, self.value, np.inf)

    def _nearest(self, count: int) -> tuple[Floats, Floats]:
        """Arguments and values (k, count) of the values next to zero, NaN where there are not so many."""
        values = self._values()
        values = np.concatenate((values, np.full((len(values), max(0, count - values.shape[1])), np.inf)), axis=1)
        arguments = np.concatenate(
            (self.argument, np.full((len(values), values.shape[1] - self.argument.shape[1]), np.nan)), axis=1
        )
        order = np.argsort(np.abs(values), axis=1, kind="stable")[:, :count]
        chosen = np.take_along_axis(values, order, axis=1)
        there = np.isfinite(chosen)
        return np.where(there, np.take_along_axis(arguments, order, axis=1), np.nan), np.where(there, chosen, np.nan)

    def _interpolated(self, low: Floats, high: Floats) -> Floats:
        """Where the inverse interpolation of highest order that leads into a bracket (k,) leads to, NaN where none does."""
        argument, value = self._nearest(NEAREST)
        square = np.square(argument)
        result = np.full(low.size, np.nan)
        with np.errstate(all="ignore"):
            if self.slope is not None:
                square_of_one = square[:, 0] - self.slope * value[:, 0]
                result = _within(np.sqrt(square_of_one), low, high, result)
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
    sections: Floats = low[:, None] + at * (high - low)[:, None]
    return sections


def _with_root(about: Floats, low: Floats, high: Floats, inside: Floats) -> Floats:
    """Arguments (k, some) well within brackets (k,), and where the root is expected, if that is `inside`."""
    margin = 1e-3 * (high - low)[:, None]
    about = np.clip(about, low[:, None] + margin, high[:, None] - margin)
    root = np.where(np.isfinite(inside), inside, about[:, 0])
    trials: Floats = np.concatenate((about, root[:, None]), axis=1)
    return trials


def _within(estimate: Floats, low: Floats, high: Floats, instead: Floats) -> Floats:
    """Estimates (k,) where they lie within brackets, and others where not."""
    return np.where((estimate > low) & (estimate < high), estimate, instead)


def _largest(values: Floats) -> Floats:
    """The largest of each row, NaN where there is none."""
    largest = np.max(values, axis=1, initial=-np.inf)
    return np.where(np.isfinite(largest), largest, np.nan)
