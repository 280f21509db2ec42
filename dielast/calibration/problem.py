"""The fit as a problem of least squares: residuals of tests and priors as functions of the coordinates.

Moduli of branches with fixed relaxation times have a prior that is smooth over log time, with a smoothness that the data determine:
it is on second differences of the log moduli over log time (Honerkamp and Weese 1993, DOI 10.1007/BF00396042), and its weight has
the greatest evidence of the linearised problem (MacKay 1992, DOI 10.1162/neco.1992.4.3.415). Fixed times are points at which a
smooth spectrum is sampled; a branch whose time is free stands for a process of its own, with any strength.
"""

from dataclasses import dataclass

import numpy as np

from dielast.calibration.laboratory import Laboratory
from dielast.calibration.levenberg import Residuals, with_slopes
from dielast.calibration.parameters import ParameterSpace
from dielast.calibration.scatter import Curves, Scatter, Weighting, Whitening
from dielast.numerics.arrays import Cases, Floats

FEWEST = 4  # branches of a spectrum with a smoothness
WEIGHTS = np.geomspace(1e-3, 1e4, 22)


@dataclass(frozen=True, slots=True, eq=False)
class FitProblem:
    """The parameters of a `space`, the tests of a `laboratory`, and `smoothness` (p, p), a precision added to the prior."""

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

    def prior_residuals(self, coordinates: Floats) -> Floats:
        """The residuals (k, 2p) of priors and smoothness at coordinates (k, p)."""
        expected = (coordinates - self.space.centre) @ root_of(self.space.precision)
        return np.concatenate((expected, coordinates @ root_of(self.smoothness)), axis=1)

    def weighted(self, curves: Curves, weighting: Weighting, chosen: Floats | None = None) -> Residuals:
        """Residuals of least squares; `chosen` (fits, tests) are factors on the weight of each test in each fit."""
        measured = curves.measured
        sizes = [values.size for values in curves.values]

        def residuals(coordinates: Floats, fits: Cases) -> Floats:
            miss = self.answers(coordinates) - measured
            weighted = weighting(miss) if chosen is None else weighting(miss, np.repeat(chosen, sizes, axis=1)[fits])
            return np.concatenate((weighted, self.prior_residuals(coordinates)), axis=1)

        return residuals


def root_of(precision: Floats) -> Floats:
    """A square root (p, p) of a precision that may be singular."""
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)


def smooth_branches(problem: FitProblem, curves: Curves, scatter: Scatter, slopes: Floats, at: Floats) -> Floats:
    """The precision (p, p) for smooth free moduli of branches with fixed times; 0 if there are too few of them.

    `slopes` (n, p) are the derivatives of all modelled values at coordinates `at` (p,).
    """
    parameters = problem.space.parameters
    moved = {each.index for each in parameters if each.name.startswith("nonequilibrium.relaxation_time[")}
    places = [
        k for k, each in enumerate(parameters) if each.name.startswith("nonequilibrium.shear_modulus[") and each.index not in moved
    ]
    if len(places) < FEWEST:
        return np.zeros((at.size, at.size))
    log = np.log([problem.space.material.spectrum.relaxation_time[parameters[k].index or 0] for k in places])
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
