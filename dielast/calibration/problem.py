"""The fit as a problem of least squares: residuals of tests and priors as functions of the coordinates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dielast.calibration.laboratory import Laboratory
from dielast.calibration.levenberg import Residuals
from dielast.calibration.parameters import ParameterSpace
from dielast.calibration.scatter import Curves, Scatter
from dielast.numerics.arrays import Cases, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """The parameters of a `space`, the tests of a `laboratory`, and `smoothness` (p, p), a precision beside that of the priors."""

    space: ParameterSpace
    laboratory: Laboratory
    smoothness: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def precision(self) -> Floats:
        """The precision (p, p) of the priors about `space.centre`, without smoothness."""
        return self.space.precision

    def answers(self, coordinates: Floats) -> Floats:
        """The simulated values (k, n) of all tests, one test after another, at coordinates (k, p)."""
        return np.concatenate(self.laboratory.answers(self.space.materials(coordinates)), axis=1)

    def curves(self, coordinates: Floats | None = None) -> Curves:
        """The measured curves with the model at coordinates (p,); without coordinates, the measured values stand for the model."""
        tests = self.laboratory.tests
        measured = tuple(test.measured for test in tests)
        names = list(dict.fromkeys(test.specimen for test in tests))
        specimen = np.array([names.index(test.specimen) for test in tests])
        model = measured
        if coordinates is not None:
            model = tuple(answer[0] for answer in self.laboratory.answers(self.space.materials(coordinates[None])))
        return Curves(measured, model, tuple(test.place for test in tests), specimen)

    def beforehand(self, coordinates: Floats) -> Floats:
        """The residuals (k, 2p) of priors and smoothness at coordinates (k, p)."""
        away = coordinates - self.space.centre
        parts = [away @ root_of(self.space.precision)]
        if self.smoothness.size:
            parts.append(coordinates @ root_of(self.smoothness))
        return np.concatenate(parts, axis=1)

    def weighted(self, curves: Curves, scatter: Scatter, chosen: Floats | None = None) -> Residuals:
        """Residuals of weighted least squares; `chosen` (fits, tests) are factors on the weight of each test in each fit.

        The weight of a curve is that of its number of correlation lengths in independent points, whatever its sampling. Several
        tests of one specimen have less weight than tests of different specimens, depending on the scatter of specimens.
        """
        weight = np.concatenate(weights_of(curves, scatter))
        measured = curves.measured
        sizes = [values.size for values in curves.values]

        def residuals(coordinates: Floats, fits: Cases) -> Floats:
            weighted = weight * (self.answers(coordinates) - measured)
            if chosen is not None:
                factor = np.repeat(chosen, sizes, axis=1)[fits]
                weighted = np.where(factor > 0, factor * weighted, 0.0)
            return np.concatenate((weighted, self.beforehand(coordinates)), axis=1)

        return residuals


def weights_of(curves: Curves, scatter: Scatter) -> list[Floats]:
    """The weight of each point of each curve (n,), 1/Pa."""
    variance = scatter.model_error**2
    shared = scatter.specimen**2 / (scatter.specimen**2 + variance) if variance > 0 else 0.0
    weights = []
    for k, (level, place) in enumerate(zip(curves.levels(), curves.places, strict=True)):
        spacing = np.gradient(place) if place.size > 1 else np.ones(1)
        independent = np.maximum(spacing, 0.0) / scatter.piece + 1e-6
        together = int(np.count_nonzero(curves.specimen == curves.specimen[k]))
        total = variance + scatter.noise[k] ** 2
        weights.append(np.sqrt(independent / (total * (1 + shared * (together - 1)))) / level)
    return weights


def root_of(precision: Floats) -> Floats:
    """A square root (p, p) of a precision that may be singular."""
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)
