"""A test beside what the calibrated material gives in it, with the band that a further specimen would lie in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dielast.calibration.experiment import Experiment
from dielast.calibration.fit import Fit
from dielast.calibration.laboratory import Laboratory
from dielast.calibration.likelihood import Likelihood
from dielast.io.result import TabularResult
from dielast.io.table import Column, Table
from dielast.numerics.arrays import Floats, rms

PARTS = 16  # equally likely parts of the scatter about a draw


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Comparison(TabularResult):
    """A test and the model: `model`, `lower` and `upper` (n,), in SI and less `rest`, as the measured values of the test.

    The interval from lower to upper covers a measured value with the level of the calibration; it includes the scatter of
    specimens, the model's error and noise. NaN if the material cannot follow the test.
    """

    test: Experiment
    fitted: bool
    model: Floats
    lower: Floats
    upper: Floats

    @property
    def followed(self) -> bool:
        """Whether the material could follow the test."""
        return bool(np.all(np.isfinite(self.model)))

    @property
    def rms_error(self) -> float:
        """Root mean square of model - measured, in the unit of the test."""
        return rms(self.model - self.test.measured)

    @property
    def rms_relative_error(self) -> float:
        """`rms_error` over the root mean square of the measured values, which include the value at rest."""
        return self.rms_error / size_of(self.test)

    @property
    def r_squared(self) -> float:
        """Share of the variance of the measured values that the model explains."""
        return 1 - self.rms_error**2 / float(np.var(self.test.measured))

    @property
    def coverage(self) -> float:
        """Share of the points between lower and upper."""
        inside = (self.test.measured >= self.lower) & (self.test.measured <= self.upper)
        return float(np.mean(inside)) if self.followed else np.nan

    def columns(self) -> Table:
        """A row for each point."""
        return [
            Column("test", None, [self.test.name] * self.test.measured.size),
            Column("time", "s", self.test.time),
            *(
                Column(name, None, values + self.test.rest)
                for name, values in (
                    ("measured", self.test.measured),
                    ("model", self.model),
                    ("lower", self.lower),
                    ("upper", self.upper),
                )
            ),
            Column("unit", None, [self.test.unit] * self.test.measured.size),
        ]


def size_of(test: Experiment) -> float:
    """The root mean square of the measured values, as in the table of residuals: with the value at rest."""
    return rms(test.measured + test.rest)


def relative_error(tests: Sequence[Experiment], misses: Sequence[Floats]) -> float:
    """The root mean square of the differences (n,) from the measured values over that of the measured values, over all points.

    The values of each test are over their own root mean square if the units of the tests differ.
    """
    mixed = len({test.unit for test in tests}) > 1
    sizes = [size_of(test) if mixed else 1.0 for test in tests]
    measured = [(test.measured + test.rest) / size for test, size in zip(tests, sizes, strict=True)]
    return rms(np.concatenate([miss / size for miss, size in zip(misses, sizes, strict=True)])) / rms(np.concatenate(measured))


def compare_tests(
    fit: Fit, likelihood: Likelihood, draws: Floats, validate: Sequence[Experiment], level: float
) -> tuple[Comparison, ...]:
    """Comparisons of the fitted tests and those to `validate` with the model, with bands for measurements on a further specimen."""
    from scipy.special import stdtrit

    tests = (*fit.problem.laboratory.tests, *validate)
    answers = Laboratory(tests).answers([fit.material, *fit.space.materials(draws)])
    # Student's, because the scatter is estimated: at the ends of the interval, and in equally likely parts for every draw
    width = float(stdtrit(likelihood.value_freedom, 0.5 * (1 + level)))
    parts = stdtrit(likelihood.value_freedom, (np.arange(PARTS) + 0.5) / PARTS)
    found = []
    for k, (test, answer) in enumerate(zip(tests, answers, strict=True)):
        model, drawn = answer[0], answer[1:]
        spread = np.sqrt(likelihood.scatters.variance(model))
        lower, upper = model - width * spread, model + width * spread
        drawn = drawn[np.all(np.isfinite(drawn), axis=1)]
        if len(drawn) > 2 and np.all(np.isfinite(model)):
            scattered = (drawn[:, None] + parts[:, None] * spread).reshape(-1, model.size)
            lower, upper = np.quantile(scattered, (0.5 * (1 - level), 0.5 * (1 + level)), axis=0)
        found.append(Comparison(test, k < len(fit.problem.laboratory.tests), model, lower, upper))
    return tuple(found)
