"""The fit as a problem of least squares: residuals of tests and priors as functions of the coordinates.

Moduli of branches have a prior that is smooth over log time, with a smoothness that the data determine: it is on second differences
of the log moduli over log time (Honerkamp and Weese 1993, DOI 10.1007/BF00396042), and its weight has the greatest evidence of the
linearised problem (MacKay 1992, DOI 10.1162/neco.1992.4.3.415).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from dielast.calibration.laboratory import Laboratory
from dielast.calibration.levenberg import Residuals, with_slopes
from dielast.calibration.parameters import ParameterSpace
from dielast.calibration.scatter import Curves, Scatter, Whitening
from dielast.numerics.arrays import Cases, Floats

FEWEST = 4  # branches of a spectrum with a smoothness
WEIGHTS = np.geomspace(1e-3, 1e4, 22)


@dataclass(frozen=True, slots=True, eq=False)
class FitProblem:
    """The parameters of a `space`, the tests of a `laboratory`, and `smoothness` (p, p), a precision beside that of the priors."""

    space: ParameterSpace
    laboratory: Laboratory
    smoothness: Floats

    @property
    def prior(self) -> Floats:
        """The precision (p, p) of the priors, with smoothness."""
        return self.space.precision + self.smoothness

    def answers(self, coordinates: Floats) -> Floats:
        """The simulated values (k, n) of all tests, one test after another, at coordinates (k, p)."""
        return np.concatenate(self.answers_of_tests(coordinates), axis=1)

    def answers_of_tests(self, coordinates: Floats) -> list[Floats]:
        """The simulated values (k, n) in each test at coordinates (k, p)."""
        return self.laboratory.answers(self.space.materials(coordinates), self.space.conditions(coordinates))

    def slopes(self, at: Floats) -> Floats:
        """The derivatives (n, p) of all simulated values by the coordinates `at` (p,)."""
        moves, alone = np.ones((1, at.size), dtype=bool), np.zeros(1, dtype=np.intp)
        _, slopes = with_slopes(lambda q, _: self.answers(q), at[None], alone, self.space.bounds, moves)
        return np.asarray(slopes[0])

    def curves(self, coordinates: Floats | None = None) -> Curves:
        """The measured curves with the model at coordinates (p,); without coordinates, the measured values stand for the model."""
        tests = self.laboratory.tests
        measured = tuple(test.measured for test in tests)
        names = list(dict.fromkeys(test.specimen for test in tests))
        specimen = np.array([names.index(test.specimen) for test in tests])
        model = measured
        if coordinates is not None:
            model = tuple(answer[0] for answer in self.answers_of_tests(coordinates[None]))
        wide = tuple(np.broadcast_to(test.wide, test.measured.shape) for test in tests)
        return Curves(measured, model, tuple(test.place for test in tests), specimen, wide, tuple(test.power for test in tests))

    def beforehand(self, coordinates: Floats) -> Floats:
        """The residuals (k, 2p) of priors and smoothness at coordinates (k, p)."""
        expected = (coordinates - self.space.centre) @ root_of(self.space.precision)
        return np.concatenate((expected, coordinates @ root_of(self.smoothness)), axis=1)

    def weighted(self, curves: Curves, scatter: Scatter, chosen: Floats | None = None) -> Residuals:
        """Residuals of generalised least squares; `chosen` (fits, tests) are factors on the weight of each test in each fit."""
        weighting = Weighting.of(curves, scatter)
        measured = curves.measured
        sizes = [values.size for values in curves.values]

        def residuals(coordinates: Floats, fits: Cases) -> Floats:
            factor = None if chosen is None else np.repeat(chosen, sizes, axis=1)[fits]
            weighted = weighting(self.answers(coordinates) - measured, factor)
            return np.concatenate((weighted, self.beforehand(coordinates)), axis=1)

        return residuals


@dataclass(frozen=True, slots=True, eq=False)
class Weighting:
    """The weighting of differences in the fit: that of points, `weight` (n,) in 1/Pa, and the factor on each specimen's stress.

    The weight of a curve is that of its number of correlation lengths in independent points, whatever its sampling. The factor of a
    specimen is a random effect (Laird and Ware 1982, DOI 10.2307/2529876) with the scatter s: with the derivatives m of modelled
    values by the logarithm of the factor (`by_factor`), the covariance of its differences is W^-2 + s^2 m m^T,
    W = diag(weight). With u = W m, the root of the inverse is [1 - (1 - 1/sqrt(1 + s^2 u.u)) u u^T/(u.u)] W, as its square shows by
    the formula of Sherman and Morrison (1950, DOI 10.1214/aoms/1177729893).
    """

    weight: Floats
    by_factor: Floats
    specimen: Cases
    scatter: float

    @classmethod
    def of(cls, curves: Curves, scatter: Scatter) -> Self:
        """For measured curves with this scatter."""
        variance = scatter.model_error**2
        weights = []
        for k, (level, place) in enumerate(zip(curves.levels(), curves.places, strict=True)):
            spacing = np.gradient(place) if place.size > 1 else np.ones(1)
            independent = np.maximum(spacing, 0.0) / scatter.piece + 1e-6
            weights.append(np.sqrt(independent / (variance + scatter.noise[k] ** 2)) / level)
        specimen = np.repeat(curves.specimen, [values.size for values in curves.values])
        return cls(np.concatenate(weights), np.concatenate(curves.by_factor), specimen, scatter.specimen)

    def __call__(self, differences: Floats, factor: Floats | None = None) -> Floats:
        """Weighted differences (..., n); `factor` (..., n) is on the weight of points, and 0 leaves a point out."""
        weight = self.weight if factor is None else factor * self.weight
        weighted = weight * (differences if factor is None else np.where(factor > 0, differences, 0.0))
        shape = weight * self.by_factor
        for specimen in np.unique(self.specimen):
            rows = self.specimen == specimen
            u = shape[..., rows]
            size = np.sum(np.square(u), axis=-1, keepdims=True)
            root = np.sqrt(1 + self.scatter**2 * size)
            # (1 - 1/root)/size, without its difference of close numbers
            share = self.scatter**2 / (root * (1 + root))
            weighted[..., rows] -= share * u * np.sum(u * weighted[..., rows], axis=-1, keepdims=True)
        return weighted


def root_of(precision: Floats) -> Floats:
    """A square root (p, p) of a precision that may be singular."""
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)


def smooth_branches(problem: FitProblem, curves: Curves, scatter: Scatter, slopes: Floats, at: Floats) -> Floats:
    """The precision (p, p) for smooth free moduli of branches; 0 if there are too few of them.

    `slopes` (n, p) are the derivatives of all modelled values at coordinates `at` (p,).
    """
    places = [
        k for k, parameter in enumerate(problem.space.parameters) if parameter.name.startswith("nonequilibrium.shear_modulus[")
    ]
    if len(places) < FEWEST:
        return np.zeros((at.size, at.size))
    log = np.log([problem.space.material.spectrum.relaxation_time[problem.space.parameters[k].index or 0] for k in places])
    order = np.argsort(-log, kind="stable")
    places, time = [places[k] for k in order], log[order]
    bends = np.zeros((len(places) - 2, at.size))
    for row in range(len(places) - 2):
        first, middle, last = (time[row + offset] for offset in range(3))
        share = (middle - first) / (last - first)
        # over the typical spacing, so that the weight does not depend on the number of branches in a decade
        size = abs(last - first) / 2
        bends[row, places[row : row + 3]] = np.array((1 - share, -1.0, share)) / size
    rough = bends.T @ bends
    whiten = Whitening(curves, scatter)
    miss, jacobian = whiten(-curves.differences), whiten(slopes.T).T
    prior = problem.space.precision
    normal = jacobian.T @ jacobian + prior
    # the linearised problem about the point where all coordinates are zero
    target = jacobian.T @ (jacobian @ at - miss) + prior @ problem.space.centre
    best, chosen = -np.inf, 0.0
    for weight in WEIGHTS:
        matrix = normal + weight * rough
        values = np.linalg.eigvalsh(matrix)
        if values[0] <= 1e-12 * values[-1]:
            continue
        gain = float(target @ np.linalg.solve(matrix, target))
        evidence = gain - float(np.sum(np.log(values))) + len(bends) * np.log(weight)
        if evidence > best:
            best, chosen = evidence, float(weight)
    return chosen * rough
