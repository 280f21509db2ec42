"""Cross-validation (Stone 1974): each test, or all tests of a specimen, predicted from a fit to the others."""

from __future__ import annotations

import numpy as np

from dielast.calibration.fit import Fit
from dielast.calibration.levenberg import minimise

MOST_FOLDS = 12
ITERATIONS = 12
PRECISE = 1e-4


def cross_validation_error(fit: Fit) -> float | None:
    """The relative rms error over all points where each test of a fit is predicted from fits to the others, all at once; tests of
    one specimen are left out together if there are several specimens. None for a single test.
    """
    tests, curves = fit.problem.laboratory.tests, fit.curves
    specimens = np.unique(curves.specimen)
    group = curves.specimen if specimens.size > 1 else np.arange(len(tests))
    fold = np.asarray(np.unique(group, return_inverse=True)[1]) % MOST_FOLDS
    folds = int(fold.max()) + 1
    if folds < 2:
        return None
    chosen = (fold[None, :] != np.arange(folds)[:, None]).astype(float)
    lower, upper = fit.space.bounds
    start = np.repeat(fit.coordinates[None], folds, axis=0)
    residuals = fit.problem.weighted(curves, fit.scatter, chosen)
    solutions = minimise(residuals, start, lower, upper, iterations=ITERATIONS, settled=PRECISE)
    answers = curves.split(fit.problem.answers(solutions.coordinates))
    misses = [answers[k][fold[k]] - values for k, values in enumerate(curves.values)]
    total = np.mean(np.square(np.concatenate(misses))) / np.mean(np.square(curves.measured))
    return float(np.sqrt(total))
